//! Where a fleet's server is, and what it takes to be let in.

use std::fmt;
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The port of a server whose address names none.
const PORT: u16 = 4222;

/// The largest file of credentials [bytes].
const LARGEST: u64 = 64 << 10;

/// The address of a server: `nats://HOST[:PORT]`, or `tls://HOST[:PORT]` for one that must encrypt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Address {
    /// Whether the connection must be encrypted.
    pub is_tls: bool,
    /// Name or number of the computer; of a number of IPv6, with its brackets.
    pub host: String,
    /// Its port.
    pub port: u16,
}

impl Address {
    /// Whether nobody but this computer's users can listen in.
    pub fn is_local(&self) -> bool {
        self.host == "localhost" || self.host == "[::1]" || self.host.starts_with("127.")
    }
}

impl fmt::Display for Address {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = if self.is_tls { "tls" } else { "nats" };
        write!(formatter, "{scheme}://{}:{}", self.host, self.port)
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        const RIGHT: &str =
            "write nats://HOST:PORT, or tls://HOST:PORT for an encrypted connection";
        let (scheme, rest) =
            text.split_once("://").ok_or_else(|| format!("there is no `://` in it: {RIGHT}"))?;
        let is_tls = match scheme {
            "nats" => false,
            "tls" => true,
            other => return Err(format!("{other:?} is not spoken: {RIGHT}")),
        };
        // What stands before it may be a password, so it is not repeated.
        if rest.contains('@') {
            return Err("a name or password in the address is seen by everybody who lists processes: write it into a \
                        file, and name that as the credentials"
                .to_owned());
        }
        let rest = rest.strip_suffix('/').unwrap_or(rest);
        let (host, port) = match rest.strip_prefix('[').and_then(|it| it.split_once(']')) {
            Some((host, after)) => {
                (format!("[{host}]"), after.strip_prefix(':').map_or(after, |port| port))
            }
            None => rest
                .split_once(':')
                .map_or((rest.to_owned(), ""), |(host, port)| (host.to_owned(), port)),
        };
        let is_host = !host.is_empty()
            && host.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"._-:[]".contains(&byte));
        if !is_host {
            return Err(format!("{host:?} is no computer: {RIGHT}"));
        }
        let port = if port.is_empty() { Ok(PORT) } else { port.parse() };
        let port = port
            .ok()
            .filter(|port| *port > 0)
            .ok_or_else(|| format!("the port is none: {RIGHT}"))?;
        Ok(Self { is_tls, host, port })
    }
}

/// What lets somebody in. Its words are never shown.
#[derive(Clone, PartialEq, Eq)]
pub enum Credentials {
    /// The text of a file of a NATS user: token and seed.
    User(String),
    /// The seed of an nkey.
    Seed(String),
    /// A token.
    Token(String),
    /// A name and a password.
    Password {
        /// The name.
        user: String,
        /// The password.
        password: String,
    },
}

impl fmt::Debug for Credentials {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::User(_) => "Credentials::User",
            Self::Seed(_) => "Credentials::Seed",
            Self::Token(_) => "Credentials::Token",
            Self::Password { .. } => "Credentials::Password",
        })
    }
}

impl Credentials {
    /// Reads the file at `path`, which must be its user's alone.
    ///
    /// # Errors
    /// One that cannot be read, that others can read, or that has none in it: in words that have nothing of it in them.
    pub fn read(path: &Path) -> Result<Self, String> {
        let at = |text: String| format!("{}: {text}", path.display());
        let data = fs::metadata(path).map_err(|error| at(error.to_string()))?;
        if data.mode() & 0o077 != 0 {
            return Err(at(
                "others can read these credentials: `chmod 600` makes them yours alone".to_owned(),
            ));
        }
        if data.len() > LARGEST {
            return Err(at(format!("{} bytes are too many for credentials", data.len())));
        }
        let text = fs::read_to_string(path).map_err(|error| at(error.to_string()))?;
        Self::parse(&text).map_err(|error| at(error.to_owned()))
    }

    fn parse(text: &str) -> Result<Self, &'static str> {
        const RIGHT: &str = "there are no credentials in it: write the file that the server's keeper gave you (.creds, or the \
                             seed of an nkey), or a line `token=…`, or the lines `user=…` and `password=…`";
        if text.contains("BEGIN NATS USER JWT") {
            return Ok(Self::User(text.to_owned()));
        }
        let lines = || {
            text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#'))
        };
        let value = |key: &str| {
            lines().find_map(|line| {
                Some(line.strip_prefix(key)?.trim_start().strip_prefix('=')?.trim().to_owned())
            })
        };
        if let Some(token) = value("token").filter(|it| !it.is_empty()) {
            return Ok(Self::Token(token));
        }
        if let (Some(user), Some(password)) = (value("user"), value("password")) {
            return Ok(Self::Password { user, password });
        }
        let is_seed = |line: &&str| line.starts_with("SU") && line.len() == 58;
        lines().find(is_seed).map(|seed| Self::Seed(seed.to_owned())).ok_or(RIGHT)
    }
}

/// How a server is reached.
#[derive(Debug, Clone)]
pub struct Server {
    /// Where it is.
    pub address: Address,
    /// What lets us in; `None` where nobody asks.
    pub credentials: Option<Credentials>,
    /// The certificates that it is known by; `None` for those of this computer.
    pub authority: Option<PathBuf>,
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn addresses_are_read_and_written() {
        for (text, written) in [
            ("nats://hall", "nats://hall:4222"),
            ("tls://fleet.example.org:4443/", "tls://fleet.example.org:4443"),
            ("nats://10.0.0.5:1", "nats://10.0.0.5:1"),
            ("nats://[::1]:4333", "nats://[::1]:4333"),
            ("nats://[fe80::1]", "nats://[fe80::1]:4222"),
        ] {
            assert_eq!(text.parse::<Address>().unwrap().to_string(), written);
        }
        assert!("nats://[::1]".parse::<Address>().unwrap().is_local());
        assert!(!"nats://10.0.0.5".parse::<Address>().unwrap().is_local());
    }

    #[test]
    fn what_is_no_address_is_refused_and_a_password_in_it_is_not_repeated() {
        for (text, word) in [
            ("hall:4222", "nats://HOST"),
            ("http://hall", "\"http\""),
            ("nats://", "no computer"),
            ("nats://hall:0", "port"),
            ("nats://hall:x", "port"),
            ("nats://hall/x", "no computer"),
            ("nats://ada:geheim@hall", "file"),
        ] {
            let error = text.parse::<Address>().unwrap_err();
            assert!(error.contains(word) && !error.contains("geheim"), "{text}: {error}");
        }
    }

    #[test]
    fn credentials_are_read_by_what_they_are_and_never_shown() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("credentials");
        let seed = format!("SU{}", "A".repeat(56));
        let jwt = "-----BEGIN NATS USER JWT-----\ngeheim\n------END NATS USER JWT------\n";
        let read = |text: &str, mode: u32| {
            fs::write(&path, text).unwrap();
            fs::set_permissions(&path, fs::Permissions::from_mode(mode)).unwrap();
            Credentials::read(&path)
        };
        let password =
            Credentials::Password { user: "ada".to_owned(), password: "geheim = x".to_owned() };
        for (text, expect) in [
            (jwt, Credentials::User(jwt.to_owned())),
            (&format!("# of cell 1\n{seed}\n"), Credentials::Seed(seed.clone())),
            ("token = geheim\n", Credentials::Token("geheim".to_owned())),
            ("user=ada\npassword=geheim = x\n", password),
        ] {
            let found = read(text, 0o600).unwrap();
            assert_eq!(found, expect);
            let shown = format!("{found:?}");
            assert!(!shown.contains("geheim") && !shown.contains("SUA"), "{shown}");
        }
        let error = read("token=geheim", 0o640).unwrap_err();
        assert!(error.contains("chmod 600") && !error.contains("geheim"), "{error}");
        let error = read("geheim\n", 0o600).unwrap_err();
        assert!(error.contains("token=") && !error.contains("geheim"), "{error}");
        assert!(Credentials::read(&folder.path().join("none")).unwrap_err().contains("none"));
    }
}
