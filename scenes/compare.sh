#!/bin/sh
# Every integrator on every scene of this folder, error against time, in one report.
#
#   sh scenes/compare.sh [FOLDER]
#
# writes FOLDER/index.html, converge.csv and converge.json (FOLDER is out/compare if not given). References are rendered
# once and kept. With the defaults this takes hours; less of everything is quicker:
#
#   SIZE=160x90 TIME=5s SEEDS=2 REFERENCE_TIME=1m SCENES="cornell door" sh scenes/compare.sh out/quick
set -eu
cd "$(dirname "$0")/.."

out=${1:-out/compare}
scenes=${SCENES:-"cornell door colonnade bedroom classroom house cathedral cafe caustic many-lamps"}
files=
for scene in $scenes; do
    files="$files scenes/$scene/$scene.xml"
done

# Integrators come from the program's own list, each with its defaults; INTEGRATORS names others, with parameters if wanted.
# shellcheck disable=SC2086 # one word for each scene and option
exec ${LIGHTSIEVE:-cargo run --release --} converge $files ${INTEGRATORS:+-i "$INTEGRATORS"} ${SIZE:+--size "$SIZE"} \
    --time "${TIME:-60s}" --seeds "${SEEDS:-3}" --reference-time "${REFERENCE_TIME:-30m}" --report "$out"
