#!/usr/bin/env bash
# ./robotont test --systems [NAME ...]: ./robotont demo and ./robotont test in fresh systems, as on a new computer.
# Started by ../robotont, whose lifeline ends it and removes its folder; what runs in a system and what is mounted there
# lies in namespaces of its own and goes with them. Base systems are kept in the folder SYSTEMS.
set -euo pipefail

ROOT=$1 SYSTEMS=$2 RUN=$3
shift 3

codename() {
    case $1 in debian-11) echo bullseye ;; debian-12) echo bookworm ;; debian-13) echo trixie ;; *) return 1 ;; esac
}

# inside COMMAND ...: in namespaces of its own. This shell waits beside it: unshare ignores Ctrl-C, and so would a shell that
# has it in its foreground.
inside() {
    (trap - INT && exec unshare -m -p -f --kill-child "$@") &
    wait "$!"
}

# The packages of a Debian that has just been installed, as an archive: whole or not at all.
make_base() {
    [ ! -f "$SYSTEMS/$1.tar" ] || return 0
    echo "$1: installing the base system"
    mkdir "$RUN/base"
    inside debootstrap --variant=minbase --include=git,ca-certificates "$(codename "$1")" \
        "$RUN/base" >"$SYSTEMS/$1.debootstrap.log" 2>&1 || { tail -5 "$SYSTEMS/$1.debootstrap.log"; return 1; }
    rm -rf "$RUN/base/var/cache/apt/archives/"*.deb
    tar -C "$RUN/base" -cf "$RUN/$1.tar" .
    mv "$RUN/$1.tar" "$SYSTEMS/"
    rm -rf "$RUN/base"
}

# What a new user does, inside; the repository is at /mnt. Each step's log and "STEP SECONDS STATUS" in /results.
as_a_new_user() {
    cat <<'END'
mount -t sysfs -o ro sys /sys && mount -t cgroup2 -o ro none /sys/fs/cgroup
mount -t tmpfs tmpfs /run
mkdir /home/new && cd /home/new && git config --global --add safe.directory '*' && git clone -q /mnt robotont && cd robotont || exit 1
for step in demo test; do
    began=$SECONDS
    ./robotont $step >/results/$step.log 2>&1
    echo "$step $((SECONDS - began)) $?" >>/results/steps
    [ $step = test ] || du -scm /var/cache/apt/archives ~/.cache/pip 2>/dev/null | tail -1 | cut -f 1 >/results/megabytes
done
END
}

# try_system NAME: prints its row.
try_system() {
    local system=$RUN/$1 logs=$SYSTEMS/$1.logs kept=() name
    make_base "$1" || return 1
    rm -rf "$logs" && mkdir -p "$system" "$logs"
    tar -C "$system" -xf "$SYSTEMS/$1.tar"
    mkdir -p "$system/results"
    cp /etc/resolv.conf /etc/hosts "$system/etc/"
    cp /etc/ssl/certs/ca-certificates.crt "$system/etc/ssl/certs/"  # also of a network that has one of its own
    as_a_new_user >"$system/as_a_new_user"
    for name in http_proxy https_proxy no_proxy PIP_CERT PIP_DEFAULT_TIMEOUT; do
        [ -z "${!name:-}" ] || kept+=("$name=${!name}")
    done
    # its root is that of a mount namespace, else nsenter in a test would leave it
    # shellcheck disable=SC2016
    inside bash -euc 'mount --bind "$1" "$1"; mount --rbind /dev "$1/dev"
        mount -t proc proc "$1/proc"; mount --bind -o ro "$2" "$1/mnt"; mkdir "$1/old"; cd "$1"; shift 2
        pivot_root . old; umount -l /old; exec "$@"' - "$system" "$ROOT" env -i HOME=/root USER=root LANG=C.UTF-8 \
        TERM=dumb PATH=/usr/sbin:/usr/bin:/sbin:/bin "ROBOTONT_LIFELINE=$ROBOTONT_LIFELINE" "${kept[@]}" \
        bash /as_a_new_user || true
    mv "$system/results/"* "$logs/" || true
    write_row "$1" "$logs"
    rm -rf "$system"
    ! grep -qv " 0$" "$logs/steps" && [ "$(wc -l <"$logs/steps")" = 2 ]
}

# write_row NAME LOGS: system, Python, seconds of demo and test, megabytes that the demo downloaded, tests by their end.
write_row() {
    local seconds count
    seconds=$(cut -d " " -f 2 "$2/steps" | xargs | sed 's/ / | /')
    for count in passed failed error skipped; do
        grep -E "^[0-9]+ .* in [0-9.]+s" "$2/test.log" | grep -oE "[0-9]+ $count" | awk '{n += $1} END {print n + 0}'
    done | xargs | {
        read -r passed failed errors skipped
        echo "$(sed -n "s/^$1 | \([^|]*| [^|]*\)|.*/| \1/p" "$ROOT/setup/systems.txt")| $seconds" \
            "| $(cat "$2/megabytes") | $passed | $((failed + errors)) | $skipped |"
    } >"$2/row"
}

[ $# != 0 ] || set -- debian-11 debian-12 debian-13
status=0
for name; do
    codename "$name" >/dev/null || { echo "found '$name', allowed: debian-11 debian-12 debian-13" >&2; exit 1; }
done
if [ "$(id -u)" != 0 ] || ! command -v debootstrap >/dev/null; then
    echo "skipped: $* (needs root and debootstrap)"
    exit 0
fi
for name; do
    try_system "$name" || status=1
done
echo "| system | Python | demo, s | test, s | packages for the demo, MiB | passed | failed | skipped |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- |"
for name; do
    cat "$SYSTEMS/$name.logs/row" || true
done
echo "logs: $SYSTEMS/*.logs"
exit "$status"
