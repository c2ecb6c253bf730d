//! Where instances have their files, and what dead ones left.

use super::finding::Finding;
use super::host::Host;
use super::memory::SHARED_MEMORY;
use runtime::Instance;
use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::MetadataExt;

/// What the names of all shared memory of Graver begin with.
const PREFIX: &str = "graver_";

/// Whether the run directory is usable, and whose it is.
pub(super) fn run_directory(host: &Host) -> Finding {
    const CHECK: &str = "run directory";
    const WHY: &str = "operators and services find a pipeline there; both must be of one user, and nobody else may write in it";
    if !host.is_this_one() {
        return Finding::unknown(CHECK, "not tried for another computer", WHY);
    }
    let instance = match Instance::new("default") {
        Ok(instance) => instance,
        Err(error) => {
            let remedy = "unset XDG_RUNTIME_DIR, or name a directory of your own in it";
            return Finding::problem(CHECK, error.to_string(), WHY, remedy);
        }
    };
    let root = instance.root();
    let base = root.parent().unwrap_or(&root).display().to_string();
    match instance.warnings().first() {
        Some(warning) => {
            Finding::advice(CHECK, warning.clone(), WHY, "have the owner remove it, or ask root to")
        }
        None => Finding::ok(CHECK, base, WHY),
    }
}

/// Whether shared memory of instances is left that no process has any more.
pub(super) fn leftovers(host: &Host) -> Finding {
    const CHECK: &str = "leftovers";
    const WHY: &str =
        "shared memory of killed instances takes room until their next start removes it";
    let Ok(user) = fs::metadata(host.path("/proc/self")).map(|process| process.uid()) else {
        return Finding::unknown(CHECK, "/proc cannot be read", WHY);
    };
    let segments = segments(host, user);
    let used = used(host);
    let dead: Vec<_> =
        segments.iter().filter(|(domain, _)| !used.contains(domain.as_str())).collect();
    if dead.is_empty() {
        let found = match segments.len() {
            0 => "none, and no instance runs".to_owned(),
            1 => "none; one instance runs".to_owned(),
            count => format!("none; {count} instances run"),
        };
        return Finding::ok(CHECK, found, WHY);
    }
    let bytes: u64 = dead.iter().map(|(_, bytes)| **bytes).sum();
    let found = format!("{} of dead instances, {} KiB", dead.len(), bytes.div_ceil(1024));
    let names: Vec<_> =
        dead.iter().map(|(domain, _)| format!("{SHARED_MEMORY}/{domain}*")).collect();
    Finding::advice(CHECK, found, WHY, format!("rm -r {}", names.join(" ")))
}

/// What of shared memory belongs to domains of this user, in bytes, by what their names begin with:
/// `graver_HASH_NONCE_`.
fn segments(host: &Host, user: u32) -> BTreeMap<String, u64> {
    let mut domains = BTreeMap::new();
    for name in host.names(SHARED_MEMORY) {
        let Some(domain) = domain_of(&name) else { continue };
        let path = host.path(SHARED_MEMORY).join(&name);
        let Ok(file) = fs::symlink_metadata(path) else { continue };
        if file.uid() == user {
            *domains.entry(domain.to_owned()).or_insert(0) += file.len();
        }
    }
    domains
}

/// What the name of a piece of shared memory has in common with all of its domain.
fn domain_of(name: &str) -> Option<&str> {
    let rest = name.strip_prefix(PREFIX)?;
    let hash = rest.find('_')?;
    let nonce = rest[hash + 1..].find('_')?;
    Some(&name[..PREFIX.len() + hash + 1 + nonce + 1])
}

/// The domains that a process has in its memory. Those of other users cannot be seen, and are not asked about.
fn used(host: &Host) -> std::collections::BTreeSet<String> {
    let processes = host.names("/proc").into_iter().filter(|name| name.parse::<u32>().is_ok());
    processes
        .filter_map(|process| host.text(&format!("/proc/{process}/maps")))
        .flat_map(|maps| {
            let names = maps.lines().filter_map(|line| {
                let (_, name) = line.split_once(&format!("{SHARED_MEMORY}/"))?;
                domain_of(name).map(str::to_owned)
            });
            names.collect::<Vec<_>>()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::super::finding::Verdict;
    use super::*;

    #[test]
    fn a_name_tells_its_domain() {
        assert_eq!(domain_of("graver_abcdefgh_ijklmn_x_y.data"), Some("graver_abcdefgh_ijklmn_"));
        for other in ["graver_abc", "graver-1000", "iox2_abcdefgh_ijklmn_", "graver_abcdefgh_x"] {
            assert_eq!(domain_of(other), None, "{other}");
        }
    }

    #[test]
    fn only_what_no_process_has_is_left_over() {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        fs::create_dir_all(at("dev/shm")).unwrap();
        fs::create_dir_all(at("proc/self")).unwrap();
        fs::create_dir_all(at("proc/17")).unwrap();
        let host = Host::new(folder.path());
        assert_eq!(leftovers(&host).verdict, Verdict::Ok);
        for (name, size) in
            [("graver_a_b_1", 4096), ("graver_a_b_2", 4096), ("graver_c_d_1", 1024), ("other", 1)]
        {
            fs::write(at("dev/shm").join(name), vec![0; size]).unwrap();
        }
        let maps =
            "7f00-7f01 rw-s 00000000 00:1a 5 /dev/shm/graver_a_b_1\n7f01-7f02 r--p 0 /lib/x\n";
        fs::write(at("proc/17/maps"), maps).unwrap();
        let found = leftovers(&host);
        assert_eq!(
            (found.verdict, found.found.as_str()),
            (Verdict::Advice, "1 of dead instances, 1 KiB")
        );
        assert_eq!(found.remedy.unwrap(), "rm -r /dev/shm/graver_c_d_*");
        fs::remove_file(at("dev/shm/graver_c_d_1")).unwrap();
        assert_eq!(leftovers(&host).found, "none; one instance runs");
    }
}
