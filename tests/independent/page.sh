#!/bin/sh
# Operates a machine through the live page in a browser, and prints what was found; ends with 1 where something is wrong.
#
#   tests/independent/page.sh GRAVER [MACHINE]     starts a domain with its services, and the page beside it
#   GRAVER_PAGE=http://127.0.0.1:7180 tests/independent/page.sh     looks at a page that is open already
#
# Needs node, npm and Chromium (CHROMIUM names it). puppeteer-core and axe-core are installed from npm into a temporary
# folder. PICTURES names a folder for pictures of the page.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
# A short name: the sockets below it have room for 107 bytes.
folder=$(mktemp -d /tmp/pXXXXXX)
trap 'rm -rf "$folder"' EXIT INT TERM
(cd "$folder" && npm init --yes >npm.log && npm install --no-audit --no-fund puppeteer-core@24 axe-core@4 >>npm.log 2>&1) || {
    cat "$folder/npm.log" >&2
    exit 2
}
mkdir "$folder/driver"
cp "$here"/page*.mjs "$here"/../../serve/assets/*.js "$folder/driver/"
echo '{ "type": "module" }' >"$folder/driver/package.json"
node --test --test-reporter=spec "$folder/driver/page_modules.mjs"
node "$folder/driver/page.mjs" "$folder" "$@"
