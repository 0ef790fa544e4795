#!/bin/sh
# Compares the pictures of two builds of lightsieve bit for bit: the check of a change that must not change any picture.
#
#   sh tests/same-bits.sh OLD NEW [INTEGRATOR ...]
#
# OLD and NEW are the two programs. Every integrator that both list (or those named) renders six scenes at 96x54 with 8 samples per
# pixel; and, on the first scene, a crop window, a thin lens, and a render that is interrupted after 3 samples and resumed.
# Pictures are compared as files of 32-bit floats (PFM). Where one differs, its relMSE against OLD is printed. The exit code is 1 if any
# differs. Environment: SCENES (names in scenes/), SPP, SIZE, OUT (folder for the pictures of OLD, kept and used again if OUT is set).
set -u
cd "$(dirname "$0")/.."

old=${1:?usage: sh tests/same-bits.sh OLD NEW [INTEGRATOR ...]}
new=${2:?usage: sh tests/same-bits.sh OLD NEW [INTEGRATOR ...]}
shift 2
scenes=${SCENES:-door cornell colonnade caustic many-lamps bedroom}
spp=${SPP:-8}
size=${SIZE:-96x54}
scratch=$(mktemp -d)
lens=
trap 'rm -rf "$scratch" ${lens:+"$lens"}' EXIT
kept=${OUT:-$scratch/old}
mkdir -p "$kept" "$scratch/new"

names() { "$1" list 2>/dev/null | sed -n 's/^\([a-z][a-z-]*\).*/\1/p'; }
if [ $# -gt 0 ]; then
    integrators=$*
else
    names "$new" >"$scratch/names"
    integrators=$(names "$old" | grep -Fx -f "$scratch/names")
fi

compared=0
differing=0

# picture NAME ARGUMENTS...: renders the picture NAME with both programs and compares the two.
picture() {
    name=$1
    shift
    [ -s "$kept/$name" ] || "$old" render "$@" --size "$size" --quiet -o "$kept/$name" || exit 2
    "$new" render "$@" --size "$size" --quiet -o "$scratch/new/$name" || exit 2
    judge "$name"
}

judge() {
    compared=$((compared + 1))
    cmp -s "$kept/$1" "$scratch/new/$1" && return
    differing=$((differing + 1))
    printf '%s differs: ' "$1"
    "$new" compare "$scratch/new/$1" "$kept/$1" | awk '/^ *relMSE/ { printf "%s ", $0 } END { print "" }'
}

# resumed PROGRAM FILE ARGUMENTS...: the picture after an interruption.
resumed() {
    program=$1
    target=$2
    shift 2
    "$program" render "$@" --size "$size" --quiet --spp 3 --checkpoint "$scratch/state" -o "$target" || exit 2
    "$program" render "$@" --size "$size" --quiet --spp "$spp" --resume "$scratch/state" -o "$target" || exit 2
    rm -f "$scratch/state"
}

first=
for scene in $scenes; do
    xml=scenes/$scene/$scene.xml
    first=${first:-$xml}
    for integrator in $integrators; do
        picture "$scene-$integrator.pfm" "$xml" -i "$integrator" --spp "$spp"
    done
done

lens=${first%.xml}-thin-lens-$$.xml
sed -e 's/type="perspective"/type="thinlens"/' -e '/type="thinlens"/a\
<float name="aperture_radius" value="0.05"/><float name="focus_distance" value="3"/>' "$first" >"$lens"
for integrator in $integrators; do
    picture "crop-$integrator.pfm" "$first" -i "$integrator" --spp "$spp" --crop 17,9,40,30
    picture "thin-lens-$integrator.pfm" "$lens" -i "$integrator" --spp "$spp"
    [ -s "$kept/resumed-$integrator.pfm" ] || resumed "$old" "$kept/resumed-$integrator.pfm" "$first" -i "$integrator"
    resumed "$new" "$scratch/new/resumed-$integrator.pfm" "$first" -i "$integrator"
    judge "resumed-$integrator.pfm"
done

echo "$compared pictures compared, $differing differ"
[ "$compared" -gt 0 ] && [ "$differing" -eq 0 ]
