#!/usr/bin/env bash
# Installs the Debian 12 packages that mp2p_icp needs, those of them that are missing. sudo only when not root.
#   scripts/install-dependencies.sh [ci]      ci: also what .ci/run needs (clang-format; a virtual screen and a browser for tests)
set -euo pipefail

packages=(build-essential cmake ninja-build pkg-config ccache
  libmrpt-dev mrpt-common libeigen3-dev libnanoflann-dev libtbb-dev libcli11-dev libgtest-dev libbenchmark-dev
  zlib1g-dev libdeflate-dev liblzf-dev libfyaml-dev libegl1 libgl1-mesa-dri glmark2-data python3-matplotlib)
[ "${1:-}" = ci ] && packages+=(clang-format git xvfb xdotool chromium-headless-shell)

missing=()
for package in "${packages[@]}"; do
  [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing+=("$package")
done
[ ${#missing[@]} -eq 0 ] && exit 0

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "These Debian packages are missing, and there is no sudo to install them: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "Installing Debian packages: ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}"
