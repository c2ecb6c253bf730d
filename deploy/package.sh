#!/usr/bin/env bash
# Makes the Debian package of the release build in target/release: `cargo install cargo-deb`, then `bash deploy/package.sh [ARGUMENTS of
# cargo deb]`. Man pages and completions come from the program itself.
set -euo pipefail
cd "$(dirname "$0")/.."

program=target/release/graver
[ -x "$program" ] || { echo "$program is not there: cargo build --release --locked" >&2; exit 1; }
made=target/package
rm -rf "$made"
mkdir -p "$made/man" "$made/completions"
"$program" manual "$made/man"
gzip -9n "$made/man"/*.1
"$program" completions bash >"$made/completions/graver"
"$program" completions zsh >"$made/completions/_graver"
"$program" completions fish >"$made/completions/graver.fish"
# What Debian wants to be told of each version; what has changed is in CHANGELOG.md, beside it.
version=$("$program" --version | cut -d' ' -f2)
maintainer=$(sed -n 's/^maintainer = "\(.*\)"$/\1/p' Cargo.toml)
cat >"$made/changelog" <<END
graver ($version-1) unstable; urgency=medium

  * See /usr/share/doc/graver/CHANGELOG.md.

 -- $maintainer  $(date -R)
END
cargo deb --no-build "$@"
