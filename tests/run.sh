#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests.
#   tests/run.sh [CMake options...]           folder: $MP2PICP_BUILD_DIR, default ./build
set -euo pipefail
cd "$(dirname "$0")/.."
build=${MP2PICP_BUILD_DIR:-$PWD/build}
scripts/install-dependencies.sh
scripts/build.sh "$build" -DMP2PICP_BUILD_TESTING=ON "$@"
ctest --test-dir "$build" --output-on-failure -j "$(nproc)"
