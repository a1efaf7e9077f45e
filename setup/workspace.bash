# shellcheck shell=bash
# Sourced by ./robotont: missing packages are installed, and the workspace is built. ROOT: the repository.
# WORK: what this builds lies there.

# Folder of a ROS 1 in /opt/ros; nothing where there is none.
opt_ros() {
    local distribution
    for distribution in noetic one; do
        if [ -f "/opt/ros/$distribution/setup.bash" ]; then
            echo "/opt/ros/$distribution"
            return
        fi
    done
}

# This system's name in setup/systems.txt, as debian-12.
system_name() {
    # shellcheck disable=SC1091
    (. /etc/os-release && echo "${ID:-unknown}-${VERSION_ID:-unknown}")
}

# system_row NAME: its columns in setup/systems.txt, without blanks around them; nothing for an unknown one.
system_row() {
    sed -n "s/ *| */|/g; /^$1|/p" "$ROOT/setup/systems.txt"
}

# wanted_packages GROUP ...: the distribution's packages of setup/apt_packages.txt for these groups.
wanted_packages() {
    local ros row lacks
    ros=$(opt_ros)
    row=$(system_row "$(system_name)")
    lacks=" $(cut -d "|" -f 5 <<<"$row") "
    sed 's/#.*//' "$ROOT/setup/apt_packages.txt" | while read -r group debian other; do
        case " $* " in *" $group "*) ;; *) continue ;; esac
        [ -z "$ros" ] || debian=${other:-$debian}
        debian=${debian/\*/${ros##*/}}
        case $debian:$lacks in -:* | *" $debian "*) ;; *) echo "$debian" ;; esac
    done | sort -u
}

as_root() {
    if [ "$(id -u)" = 0 ]; then
        "$@"
    elif command -v sudo >/dev/null; then
        sudo "$@"
    else
        fail "this needs root or sudo: $*"
    fi
}

# install_packages GROUP ...
install_packages() {
    local missing=() name row
    while read -r package; do
        dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
    done < <(wanted_packages "$@")
    [ ${#missing[@]} = 0 ] && return
    name=$(system_name)
    row=$(system_row "$name")
    case $row:$(opt_ros) in
        :*) fail "$name is not in setup/systems.txt: install these packages by hand: ${missing[*]}" ;;
        *"|Debian|"*:* | *:/opt/*) ;;
        *) fail "no ROS 1 in /opt/ros: docs/reference.md, \"Systems\", tells how it comes to $name" ;;
    esac
    echo "installing ${#missing[@]} packages, some minutes: ${missing[*]}"
    as_root apt-get update -qq
    as_root env DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends "${missing[@]}" \
        >"$WORK/apt.log" 2>&1 || { tail -20 "$WORK/apt.log" >&2; fail "apt-get failed; see $WORK/apt.log"; }
}

# install_python FOLDER LIST ...: the Python packages of setup/pypi/LIST.txt, into a virtual environment.
# Without PYTHONPATH: what the caller has there, as in the shell of another clone, is not installed here, not even pip.
install_python() {
    local -x PYTHONPATH=
    local venv=$WORK/$1 pip=("$WORK/$1/bin/python" -I -m pip) lists=("${@:2}")
    lists=("${lists[@]/#/$ROOT/setup/pypi/}")
    if ! "${pip[@]}" --version >"$venv.log" 2>&1; then
        rm -rf "$venv" "$venv.new"
        /usr/bin/python3 -m venv --system-site-packages "$venv.new"
        mv "$venv.new" "$venv"  # whole or not at all, whenever this is interrupted
    fi
    echo "installing Python packages for ${*:2} into $venv (up to a minute)"
    pip+=(install -q --disable-pip-version-check)
    # Ubuntu 20.04's pip 20.0.2 knows no wheels for glibc 2.17 and newer by their present names
    case $("$venv/bin/python" -I -m pip --version) in
        "pip 20."[0-2]*) "${pip[@]}" pip==24.0 >"$venv.log" 2>&1 || true ;;  # else the next line says why not
    esac
    # shellcheck disable=SC2046
    "${pip[@]}" $(printf -- '-r %s.txt ' "${lists[@]}") >"$venv.log" 2>&1 ||
        { tail -20 "$venv.log" >&2; fail "pip failed; see $venv.log"; }
}

# Inputs of the setup of a group; an unchanged value means that nothing is to be done.
setup_state() {
    readlink -f /usr/bin/python3
    opt_ros
    wanted_packages "$1"
    cat "$ROOT/setup/pypi/$1.txt" 2>/dev/null || true
}

# venv_of GROUP: where its Python packages go, if it has any.
venv_of() {
    [ -f "$ROOT/setup/pypi/$1.txt" ] || return 0
    case $1 in
        sim | fleet | calibration) echo venv ;;  # for nodes
        *) echo tools ;;  # for no node
    esac
}

# setup GROUP ... A group's state is kept beside what was installed, so that it goes when that is deleted. Python packages
# are still on their way afterwards, for the build needs none: `finish_setup` waits for them.
INSTALLING=()
setup() {
    local group folder lists missing=()
    for group; do
        folder=$WORK/$(venv_of "$group")
        [ "$(cat "$folder/setup/$group" 2>/dev/null)" = "$(setup_state "$group")" ] || missing+=("$group")
    done
    [ ${#missing[@]} != 0 ] || return 0
    install_packages "${missing[@]}"
    for folder in "" venv tools; do
        lists=()
        for group in "${missing[@]}"; do
            [ "$(venv_of "$group")" != "$folder" ] || lists+=("$group")
        done
        { trap - INT; [ ${#lists[@]} = 0 ] || install_groups "$folder" "${lists[@]}"; } &  # ends by Ctrl-C, too
        INSTALLING+=($!)
    done
}

# install_groups FOLDER GROUP ...: what they need of PyPI, if FOLDER is not empty.
install_groups() {
    local group
    [ -z "$1" ] || install_python "$@"
    mkdir -p "$WORK/$1/setup"
    for group in "${@:2}"; do
        setup_state "$group" >"$WORK/$1/setup/$group"
    done
}

finish_setup() {
    local job
    for job in ${INSTALLING[@]+"${INSTALLING[@]}"}; do
        wait "$job" || exit 1
    done
    INSTALLING=()
}

# What Python says when a Ctrl-C interrupts it.
without_tracebacks() {
    trap '' INT
    grep -v '^Traceback\|^  \|^KeyboardInterrupt' >&2
}

# This workspace only, and the one that ROBOTONT_UNDERLAY names, whatever the caller has sourced.
environment() {
    unset CMAKE_PREFIX_PATH ROS_PACKAGE_PATH PYTHONPATH PYTHONHOME VIRTUAL_ENV
    export PATH=/usr/bin:$PATH:$WORK/venv/bin ROS_HOME=$WORK/ros RUFF_CACHE_DIR=$WORK/ruff HYPOTHESIS_STORAGE_DIRECTORY=$WORK/hypothesis
    local ros site
    ros=$(opt_ros)
    set +u
    # shellcheck disable=SC1090,SC1091
    [ -z "$ros" ] || . "$ros/setup.bash" 2> >(without_tracebacks)
    # shellcheck disable=SC1090,SC1091
    [ ! -f "$WORK/devel/setup.bash" ] || . "$WORK/devel/setup.bash" 2> >(without_tracebacks)
    # shellcheck disable=SC1090,SC1091
    [ -z "${ROBOTONT_UNDERLAY:-}" ] || . "$ROBOTONT_UNDERLAY/setup.bash" --extend 2> >(without_tracebacks)
    set -u
    # last, as in PATH, so that it hides nothing: what the distribution lacks (MuJoCo), for /usr/bin/python3; no tools
    for site in "$WORK"/venv/lib/python3*/site-packages; do
        [ ! -d "$site" ] || PYTHONPATH=${PYTHONPATH:+$PYTHONPATH:}$site
    done
    export PYTHONPATH
    save_processor_time
}

# Two habits of libraries that cost much and bring nothing here.
save_processor_time() {
    # second threads of OpenBLAS wait for each other longer than our small matrices take: calibrate_wheels took twice
    # the processor time, and on a busy machine six times as long
    export OPENBLAS_NUM_THREADS=1
    # roslaunch imports one function of distutils, for which setuptools would load all of its own: half of its start
    if [ -e "/usr/lib/$(basename "$(readlink -f /usr/bin/python3)")/distutils/spawn.py" ]; then
        export SETUPTOOLS_USE_DISTUTILS=stdlib
    fi
}

build() {
    environment
    if [ ! -f "$WORK/build/Makefile" ]; then
        echo "building the workspace (some 10 s)"
        cmake -S "$ROOT" -B "$WORK/build" -DPYTHON_EXECUTABLE=/usr/bin/python3 \
            -DCATKIN_DEVEL_PREFIX="$WORK/devel" -DCMAKE_INSTALL_PREFIX="$WORK/install" \
            >"$WORK/cmake.log" 2>&1 || { tail -20 "$WORK/cmake.log" >&2; fail "cmake failed; see $WORK/cmake.log"; }
    fi
    make -C "$WORK/build" >"$WORK/make.log" 2>&1 ||
        { tail -20 "$WORK/make.log" >&2; fail "make failed; see $WORK/make.log"; }
}

# The folder for all build products, or a message why there can be none.
make_work_folder() {
    case $ROOT:$WORK in
        *[[:space:]\;\'\"\\\$\`\&\#\(\)]* | *:*:*)
            fail "catkin and roslaunch cannot work in a folder with a space or one of : ; ' \" \\ \$ \` & # ( ) in its name:
  $ROOT
  $WORK
move the clone to another folder, or rename this one"
            ;;
    esac
    if ! mkdir -p "$WORK" 2>/dev/null || [ ! -w "$WORK" ] || { [ -e "$WORK/lock" ] && [ ! -w "$WORK/lock" ]; }; then
        fail "$WORK cannot be written to; take another folder for the build:
  ROBOTONT_WORK=~/.cache/robotont ./robotont ..."
    fi
}

# A clone that was moved or copied has the paths of its old place in all that was built.
forget_another_place() {
    local place groups
    place=$(cat "$WORK/place" 2>/dev/null || echo "$ROOT $WORK")
    if [ "$place" != "$ROOT $WORK" ]; then
        groups=$(find "$WORK/venv/setup" "$WORK/tools/setup" -type f -printf '%f ' 2>/dev/null || true)
        echo "moved or copied from $place: rebuilt${groups:+; for all that was here: ./robotont setup $groups}"
        rm -rf "$WORK/build" "$WORK/devel" "$WORK/install" "$WORK/venv" "$WORK/tools" "$WORK/setup"
    fi
    echo "$ROOT $WORK" >"$WORK/place"
    touch "$WORK/CATKIN_IGNORE"  # no other workspace shall look in here for packages
}

# prepare GROUP ...: set up and build. One at a time: two runs in the same clone must not set up the same folder at once.
prepare() {
    make_work_folder
    exec 9>"$WORK/lock"
    flock -w 8 9 || { echo "another ./robotont sets up this folder: waiting for it" >&2; flock 9; }
    forget_another_place
    setup "$@"
    build
    finish_setup
    # what sudo made is the clone's owner's, too: else no build of his would work behind it
    [ "$(id -u)" != 0 ] || [ "$(stat -c %u "$ROOT")" = 0 ] || chown -R --reference="$ROOT" "$WORK" ||
        echo "$WORK could not be given to its owner: builds without sudo may fail there" >&2
    environment  # with what has come
    exec 9>&-
}
