#!/bin/sh
# Installs Debian's Wine, where it is not installed. Needs apt-get, and root.
set -e
command -v wine64 >/dev/null || [ -x /usr/lib/wine/wine64 ] && exit 0
apt-get update -qq
DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends wine wine64 >/dev/null
