#!/usr/bin/env bash
# Configures and builds into a folder, reusing what is there.
#   scripts/build.sh FOLDER [CMake options...]
set -euo pipefail
folder=$1
shift
source_folder=$(cd "$(dirname "$0")/.." && pwd)
launcher=()
export CCACHE_SLOPPINESS=pch_defines,time_macros
command -v ccache >/dev/null && launcher=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
cmake -S "$source_folder" -B "$folder" -G Ninja "${launcher[@]}" "$@" >"$folder.configure.log" 2>&1 ||
  { cat "$folder.configure.log" >&2; exit 1; }
rm -f "$folder.configure.log"
cmake --build "$folder"
