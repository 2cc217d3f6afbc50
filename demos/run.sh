#!/usr/bin/env bash
# Installs what is missing, builds, aligns two real laser scans and two samples of the Stanford bunny, and makes a
# trajectory of a whole log of laser scans.
# The pictures and results are left in demos/output/.
set -euo pipefail
cd "$(dirname "$0")/.."
build=${MP2PICP_BUILD_DIR:-$PWD/build}
scripts/install-dependencies.sh
scripts/build.sh "$build" -DMP2PICP_BUILD_APPLICATIONS=ON -DMP2PICP_BUILD_TESTING=OFF

out=demos/output
mkdir -p "$out"
rawlog="/usr/share/mrpt/datasets/2006-01ENE-21-SENA_Telecom Faculty_one_loop_only.rawlog"

echo
echo "=== 1. Two scans of a 2-D laser scanner, 0.6 m and 6 degrees apart (a real robot in a real building) ==="
"$build/bin/icp-run" --input-global "$rawlog:180" --input-local "$rawlog:182" \
  --output-result "$out/laser.yaml" --output-aligned "$out/laser-aligned.ply" --snapshot "$out/laser.png"

echo
echo "=== 2. The Stanford bunny against a moved copy of itself (20000 points each, sampled independently) ==="
"$build/bin/make-bunny-pair" /usr/share/glmark2/models/bunny.obj "$out"
"$build/bin/icp-run" --input-global "$out/bunny-global.ply" --input-local "$out/bunny-local.ply" \
  --ground-truth "$(cat "$out/bunny-truth.txt")" \
  --output-result "$out/bunny.yaml" --output-aligned "$out/bunny-aligned.ply" --snapshot "$out/bunny.png"

echo
echo "=== 3. SLAM with all scans of the robot's log: closing errors of odometry, of scan to scan, and of the pose graph ==="
"$build/bin/slam-front-end" "$rawlog" "$out"

echo
echo "Look at the pictures: $out/laser.png and $out/bunny.png"
