#!/usr/bin/env bash
# Makes the Debian package of the release build in target/release, which has all features: `cargo install cargo-deb`, then
# `bash deploy/package.sh [ARGUMENTS of cargo deb]`. Man pages and completions come from the program itself.
set -euo pipefail
cd "$(dirname "$0")/.."

program=target/release/graver
build='cargo build --release --locked --features ethercat,fleet,modbus'
[ -x "$program" ] || { echo "$program is not there: $build" >&2; exit 1; }
# The package has units for these.
for command in "modbus --instance none" "fleet status nats://127.0.0.1:1"; do
    # shellcheck disable=SC2086
    if "$program" $command 2>&1 | grep -q "built without"; then
        echo "$program cannot do \`graver ${command%% *}\`: $build" >&2
        exit 1
    fi
done
made=target/package
rm -rf "$made"
mkdir -p "$made/man" "$made/completions" "$made/upstream"
"$program" manual "$made/man"
gzip -9n "$made/man"/*.1
"$program" completions bash >"$made/completions/graver"
"$program" completions zsh >"$made/completions/_graver"
"$program" completions fish >"$made/completions/graver.fish"
gzip -9nc CHANGELOG.md >"$made/upstream/changelog.gz"
# What Debian wants to be told of each version; what has changed is in the other changelog, beside it.
version=$("$program" --version | cut -d' ' -f2)
maintainer=$(sed -n 's/^maintainer = "\(.*\)"$/\1/p' Cargo.toml)
cat >"$made/changelog" <<END
graver ($version-1) unstable; urgency=medium

  * See /usr/share/doc/graver/changelog.gz.

 -- $maintainer  $(date -R)
END
cargo deb --no-build "$@"
