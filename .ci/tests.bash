# The tests of ./robotont test, which sources this: their order, mutants, Python 3.8, fresh systems.
# shellcheck shell=bash disable=SC2164 # robotont has set -e

# With arguments what they name; else lint and the usual tests, in three steps: rostests, three at a time, beside lint and four
# of those that start processes; those that measure time, four at a time; those that need the machine to themselves. What
# only computes fills, at the lowest priority, the time in which those of the first two steps wait. Each pytest gets the
# files that hold its tests, for to collect them all takes 3 s of processor time in each of its processes; a file stays in
# one process, the longest first (conftest.py).
run_tests() {
    export PATH=$PATH:$WORK/tools/bin
    local pytest=("$WORK/tools/bin/python" -m pytest) by_file=(--dist loadfile --no-loadscope-reorder) status=0
    local usual="not long and not nightly and not faults"
    local starts="harness|subprocess|threading|pty\.|BoardPort|stand_in_board|RobotAtAPort"
    local computing starting timed alone rostests units style
    cd "$ROOT"
    export OPENBLAS_NUM_THREADS=1  # threads that numpy starts for nothing, in each of some hundred processes
    unset PYTHONDONTWRITEBYTECODE  # some hundred processes would compile the same modules
    if [ "${1:-}" = --faults ]; then
        "${pytest[@]}" -s -m "faults and not long" "${@:2}"
        return
    elif [ $# != 0 ]; then
        "${pytest[@]}" "$@"
        return
    fi
    lint >"$WORK/lint.log" 2>&1 &
    style=$!
    mapfile -t computing < <(grep -LE "$starts" robotont_*/test/test_*.py)
    mapfile -t starting < <(grep -lE "$starts" robotont_*/test/test_*.py)
    mapfile -t timed < <(grep -l "pytest\.mark\.timed" robotont_*/test/test_*.py)
    timed+=(robotont_*/test/timed_*.test)
    mapfile -t alone < <(grep -l "pytest\.mark\.alone" robotont_*/test/test_*.py)
    alone+=(robotont_*/test/alone_*.test)
    behind "${pytest[@]}" -m "not timed and $usual" -n 2 "${by_file[@]}" "${computing[@]}" >"$WORK/computing.log" 2>&1 &
    units=$!
    "${pytest[@]}" -m "not timed and $usual" -n 3 --dist load --maxschedchunk 1 robotont_*/test/*.test >"$WORK/rostests.log" 2>&1 &
    rostests=$!
    "${pytest[@]}" -m "not timed and $usual" -n 4 "${by_file[@]}" "${starting[@]}" || status=$?
    wait "$rostests" || status=$?
    cat "$WORK/rostests.log"
    wait "$style" || status=$?
    cat "$WORK/lint.log"
    "${pytest[@]}" -m "timed and not alone and $usual" -n 4 "${by_file[@]}" "${timed[@]}" || status=$?
    wait "$units" || status=$?
    cat "$WORK/computing.log"
    "${pytest[@]}" -m "alone and $usual" "${alone[@]}" || status=$?
    return "$status"
}

# What takes too long for every run: the fleet and the page's delays at length, and what is marked nightly. What each day
# brought stays in nightly/.
test_nightly() {
    local files=(robotont_fleet/test/test_fleet.py robotont_teleop/test/test_web_page_stops.py) log status=0
    local pytest=("$WORK/tools/bin/python" -m pytest -s)
    log=$WORK/nightly/$(date +%F).log
    mkdir -p "$WORK/nightly"
    cd "$ROOT"
    export PATH=$PATH:$WORK/tools/bin
    {
        timeout 1100 "${pytest[@]}" -m nightly --ignore=robotont_fleet/test/test_fleet.py || status=$?
        ROBOTONT_FLEET_PRESSES=${ROBOTONT_FLEET_PRESSES:-50} timeout 2500 "${pytest[@]}" -m "" "${files[@]}" || status=$?
        return "$status"
    } 2>&1 | tee "$log" || status=$?
    for log in "$WORK"/nightly/*.log; do
        echo "$(basename "$log" .log): $(tail -n 1 "$log")"
    done
    return "$status"
}

# behind COMMAND ...: at the lowest priority, also beside processes in sessions of their own, which Linux puts into groups.
behind() {
    setsid -w bash -c 'echo 19 >/proc/self/autogroup; exec nice -n 19 "$@"' bash "$@"
}

# On Ubuntu 20.04's Python with its versions of libraries: the usual tests without rostests, timed ones and what needs
# tf2, which is compiled. What rosrun and roslaunch start runs on this system's Python.
test_on_python38() {
    local python list venv=$WORK/python3.8 lists=(ubuntu-20.04 sim calibration flash lint test)
    for python in "$(pyenv root 2>/dev/null)"/versions/3.8*/bin/python3.8 python3.8 ""; do
        ! "${python:-true}" -c "" 2>/dev/null || break
    done
    [ -n "$python" ] || { echo "skipped: no python3.8, neither of pyenv nor on PATH"; return; }
    if [ ! -f "$venv/done" ] || [ -n "$(find "$ROOT/setup/pypi" -newer "$venv/done")" ]; then
        rm -rf "$venv"
        "$python" -m venv "$venv"
        for list in "${lists[@]}"; do
            env -u PYTHONPATH "$venv/bin/python" -I -m pip install -q --disable-pip-version-check -r "$ROOT/setup/pypi/$list.txt" \
                >"$WORK/pip.log" 2>&1 || { tail -20 "$WORK/pip.log" >&2; fail "pip failed; see $WORK/pip.log"; }
        done
        {
            echo "import sys; sys.path[:] = [path for path in sys.path if not path.startswith('$WORK/venv')]"
            echo /usr/lib/python3/dist-packages  # rospy and the messages, which are pure Python
        } >"$venv/lib/python3.8/site-packages/this_system.pth"
        touch "$venv/done"
    fi
    cd "$ROOT"
    PATH=$PATH:$venv/bin ROBOTONT_WITHOUT_TF2=1 nice -n 5 "$venv/bin/python" -m pytest \
        -m "not rostest and not timed and not long and not nightly and not faults" -n 3 --dist loadfile "$@"
}

# mutmut changes one thing at a time in each module of .ci/mutants.txt, or in those that are named, and runs the tests
# that stand beside it; each in a folder of its own, whose `mutmut show NAME` and `mutmut browse` tell more.
test_mutants() {
    local python=$WORK/mutation/bin/python module tests folder
    if ! cmp -s "$ROOT/setup/pypi/mutants.txt" "$WORK/mutation/installed"; then
        install_python mutation mutants
        cp "$ROOT/setup/pypi/mutants.txt" "$WORK/mutation/installed"
    fi
    sed 's/#.*//' "$ROOT/.ci/mutants.txt" | while read -r module tests; do
        [ -n "$module" ] || continue
        [ $# = 0 ] || [[ " $* " == *" $(basename "$module" .py) "* ]] || continue
        folder=$WORK/mutants/$(basename "$module" .py)
        rm -rf "$folder"
        mkdir -p "$folder/src" "$folder/tests"
        cp -r "$ROOT"/robotont_{driver,teleop}/src/. "$folder/src"
        cd "$ROOT"
        # shellcheck disable=SC2086
        cp robotont_driver/test/{conftest,*_bench}.py $tests "$folder/tests"
        cp pytest.ini "$folder"
        cd "$folder"
        printf '%s\n' "[mutmut]" source_paths=src "only_mutate=src/$module" also_copy=pytest.ini \
            pytest_add_cli_args_test_selection=tests pytest_add_cli_args=--hypothesis-profile=mutants >setup.cfg
        "$python" -m mutmut run </dev/null >log 2>&1 || { tail -20 log >&2; fail "mutmut failed; see $folder/log"; }
        "$python" -m mutmut results </dev/null
        echo "$module:" "$("$python" -m mutmut results --all true </dev/null | sed -n 's/.*: //p' | sort | uniq -c | xargs)"
    done
}

# In fresh systems, which are kept outside the repository.
try_systems() {
    local folder=${ROBOTONT_SYSTEMS:-${XDG_CACHE_HOME:-$HOME/.cache}/robotont/systems}
    mkdir -p "$folder"
    TMPDIR=$folder hold_lifeline
    bash "$ROOT/.ci/try_systems.bash" "$ROOT" "$folder" "${ROBOTONT_LIFELINE##*:}" "$@"
}
