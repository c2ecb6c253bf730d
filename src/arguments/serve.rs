//! Arguments of what lets people and programs in: `serve`, and the same of `run` and `domain`.

use clap::Args;
use grbl::network::Network;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::path::PathBuf;

/// Where the page is served when `serve` names nothing.
const PAGE: SocketAddr = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 7180);

/// Ways in.
#[derive(Debug, Clone, Default, Args)]
pub struct AccessArguments {
    /// Speak grbl 1.1 at this address, such as 127.0.0.1:7123, or 7123 for this computer alone. Programs of this user, and of
    /// nobody else, operate the machine there.
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub grbl: Option<SocketAddr>,
    /// From where other computers may speak grbl, such as 192.168.1.0/24; grbl knows no password. Can be repeated.
    #[arg(long, value_name = "NETWORK", value_delimiter = ',', requires = "grbl")]
    pub grbl_from: Vec<Network>,
    /// A serial port for software that cannot speak grbl over a network: a terminal that is linked here.
    #[arg(long, value_name = "PATH")]
    pub grbl_tty: Option<PathBuf>,
    /// Serve the live page, the HTTP interface and metrics at this address, such as 127.0.0.1:7180, or 7180 for this
    /// computer alone. Its user needs no token there; everybody else does.
    #[arg(long, value_name = "ADDRESS", value_parser = address)]
    pub listen: Option<SocketAddr>,
    /// The file with the tokens of the page; made where there is none. Without it one in the state folder of the instance.
    #[arg(long, value_name = "FILE", requires = "listen")]
    pub token_file: Option<PathBuf>,
    /// Ask this computer's own user for a token too, as behind a proxy.
    #[arg(long, requires = "listen")]
    pub require_token: bool,
    /// A name by which browsers may call this computer, beside its own. Can be repeated.
    #[arg(long = "host", value_name = "NAME", requires = "listen")]
    pub hosts: Vec<String>,
}

impl AccessArguments {
    /// Whether nobody is let in.
    pub fn is_empty(&self) -> bool {
        self.grbl.is_none() && self.grbl_tty.is_none() && self.listen.is_none()
    }

    /// The same, and the page on this computer where nothing is named.
    #[must_use]
    pub fn or_page(&self) -> Self {
        let listen = if self.is_empty() { Some(PAGE) } else { self.listen };
        Self { listen, ..self.clone() }
    }

    /// The same on the command line of `serve`.
    pub fn words(&self) -> Vec<String> {
        let mut words = Vec::new();
        let mut add = |name: &str, value: String| words.extend([name.to_owned(), value]);
        if let Some(address) = self.grbl {
            add("--grbl", address.to_string());
        }
        self.grbl_from.iter().for_each(|network| add("--grbl-from", network.to_string()));
        if let Some(path) = &self.grbl_tty {
            add("--grbl-tty", path.display().to_string());
        }
        if let Some(address) = self.listen {
            add("--listen", address.to_string());
        }
        if let Some(path) = &self.token_file {
            add("--token-file", path.display().to_string());
        }
        self.hosts.iter().for_each(|name| add("--host", name.clone()));
        if self.require_token {
            words.push("--require-token".to_owned());
        }
        words
    }
}

/// Arguments of `serve`.
#[derive(Debug, Clone, Args)]
pub struct ServeArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub access: AccessArguments,
    /// Name of the pipeline.
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}

/// Reads an address, or a port of this computer.
fn address(text: &str) -> Result<SocketAddr, String> {
    if let Ok(port) = text.parse::<u16>() {
        return Ok((Ipv4Addr::LOCALHOST, port).into());
    }
    let text =
        text.strip_prefix("localhost:").map_or(text.to_owned(), |port| format!("127.0.0.1:{port}"));
    text.parse()
        .map_err(|_| "write an address and a port, such as 127.0.0.1:7123 or 7123".to_owned())
}
