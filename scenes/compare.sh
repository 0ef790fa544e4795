#!/bin/sh
# Error against time of many integrators on many scenes, in one report.
#
#   sh scenes/compare.sh [FOLDER]
#
# writes FOLDER/index.html, converge.csv and converge.json (FOLDER is out/compare if not given). FIGURES says which comparisons of
# the papers to repeat, by the names below; without it every integrator takes part with its defaults.
#
#   methods      bdpt, pcbpt, ris, two-stage    Nabata et al. 2020 (weights), Figs. 1, 4, 5, 10; (two stages), Figs. 5, 11
#   caching      bdpt, ic-bdpt, skeleton        Noel and Biri 2015, Figs. 6 to 9; also as published
#   paths        M = 50 ... 800                 (weights), Figs. 6, 7; (two stages), Figs. 8, 9
#   samples      N = 1, 2, 4                    (weights), Fig. 9
#   neighbours   N_c = 0, 1, 3                  (weights), section 6.1.5
#   weights      kinds of weights               (weights), Fig. 2; (two stages), Fig. 10
#   proposals    proposal models                (weights), section 5.2; and target functions
#   first-stage  M_1 = 10^3 ... 10^5            (two stages), Fig. 6
#   last-stage   M_2 = 50 ... 800               (two stages), Fig. 7
#   regions      first stage with and without learned visibility, M_2, path: errors of blocks of pixels
#
# SCENES are names in this folder or scene files; references are rendered once and kept. With the defaults this takes hours; less of
# everything is quicker:
#
#   SIZE=160x90 TIME=5s SEEDS=2 REFERENCE_TIME=1m FIGURES="methods weights" SCENES="cornell door" sh scenes/compare.sh out/quick
set -eu
cd "$(dirname "$0")/.."

out=${1:-out/compare}
files=
for scene in ${SCENES:-cornell door colonnade bedroom classroom house cathedral cafe caustic many-lamps}; do
    if [ -f "$scene" ]; then
        files="$files $scene"
    else
        files="$files scenes/$scene/$scene.xml"
    fi
done

# The same method named twice would be measured twice.
methods=
add() {
    for method in "$@"; do
        case " $methods " in
        *" $method "*) ;;
        *) methods="$methods $method" ;;
        esac
    done
}
for figure in ${FIGURES:-}; do
    case $figure in
    methods) add bdpt:allocation=full pcbpt ris two-stage ;;
    caching)
        add bdpt:allocation=full ic-bdpt skeleton
        published=selection=per-length,weights=balance,connections_per_vertex=1,rr_depth=2,rr_scale=1,allocation=full
        add "ic-bdpt:$published" "skeleton:$published,node_acceptance=1"
        ;;
    paths) for m in 50 100 200 400 800; do add "ris:presampled_paths=$m" "two-stage:second_stage_paths=$m"; done ;;
    samples) for n in 1 2 4; do add "ris:connections_per_vertex=$n" "two-stage:connections_per_vertex=$n"; done ;;
    neighbours) for n in 0 1 3; do add "ris:nearest_caches=$n" "two-stage:nearest_caches=$n"; done ;;
    weights)
        for m in 100 10000; do add "pcbpt:presampled_paths=$m" "ris:presampled_paths=$m"; done
        add two-stage:weights=balance two-stage:weights=resampling-aware two-stage:weights=two-stage
        ;;
    proposals)
        for base in ris two-stage; do
            for model in mixture mixture-with-visibility per-cache mixture,target=radiance mixture,metric=position; do
                add "$base:proposal_model=$model"
            done
        done
        ;;
    first-stage) for m in 1000 10000 100000; do add "two-stage:presampled_paths=$m"; done ;;
    regions) add two-stage:first_stage=unoccluded,second_stage_paths=200 two-stage:first_stage=unoccluded two-stage path ;;
    last-stage) for m in 50 100 200 400 800; do add "two-stage:second_stage_paths=$m"; done ;;
    *)
        echo "compare.sh: no figure is called $figure" >&2
        exit 2
        ;;
    esac
done
methods=${INTEGRATORS:-$(echo $methods | tr ' ' ',')}

# shellcheck disable=SC2086 # one word for each scene and option
exec ${LIGHTSIEVE:-cargo run --release --} converge $files ${methods:+-i "$methods"} ${SIZE:+--size "$SIZE"} \
    --time "${TIME:-60s}" --seeds "${SEEDS:-3}" --reference-time "${REFERENCE_TIME:-30m}" \
    --reference-integrator "${REFERENCE:-two-stage}" --report "$out"
