#!/usr/bin/env bash
# Installs what is missing, builds, and runs all tests.
#   tests/run.sh [CMake options...]           folder: $MP2PICP_BUILD_DIR, default ./build
#                                             $MP2PICP_CTEST_OPTIONS: more options for ctest
set -euo pipefail
cd "$(dirname "$0")/.."
build=${MP2PICP_BUILD_DIR:-$PWD/build}
scripts/install-dependencies.sh
scripts/build.sh "$build" -DMP2PICP_BUILD_TESTING=ON "$@"
read -ra more <<<"${MP2PICP_CTEST_OPTIONS:-}"
ctest --test-dir "$build" --output-on-failure -j "$(nproc)" ${more[@]+"${more[@]}"}
