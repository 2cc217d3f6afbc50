#!/usr/bin/env bash
# Installs into a scratch folder, then builds and runs projects outside the tree that find the packages there.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${MP2PICP_BUILD_DIR:-$PWD/build}
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
cmake --install "$build" --prefix "$scratch/prefix" >/dev/null
cp -r tests/consumer "$scratch/consumer"
cmake -S "$scratch/consumer" -B "$scratch/build" -G Ninja -DCMAKE_PREFIX_PATH="$scratch/prefix"
cmake --build "$scratch/build"
for program in "$scratch"/build/use_*; do
  echo "running $(basename "$program")"
  LD_LIBRARY_PATH="$scratch/prefix/lib/$(gcc -print-multiarch):$scratch/prefix/lib" "$program"
done
LD_LIBRARY_PATH="$scratch/prefix/lib/$(gcc -print-multiarch):$scratch/prefix/lib" "$scratch/prefix/bin/icp-run" --version
