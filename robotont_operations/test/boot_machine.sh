#!/bin/sh
# Boots systemd on a copy-on-write view of this machine, without a network.
# $1: an empty folder; $2: file system tree laid over the root, with what is installed; $3: the unit to boot into.
# The booted machine finds $1/shared as /shared. To be run as `unshare --mount --pid --net --uts --ipc --fork sh boot_machine.sh ...`
set -eu
folder=$1
tree=$2
unit=$3
mkdir -p "$folder/layer" "$folder/root" "$folder/shared"
mount -t tmpfs tmpfs "$folder/layer"
mkdir "$folder/layer/upper" "$folder/layer/work"
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/layer/upper,workdir=$folder/layer/work" "$folder/root"
root=$folder/root
cp -a "$tree/." "$root/"
rm -rf "$root"/etc/systemd/network "$root"/var/lib/robotont
mount -t proc proc "$root/proc"
mount -t sysfs -o ro sysfs "$root/sys"
mount -t tmpfs tmpfs "$root/sys/fs/cgroup"
umount "$root/sys/fs/cgroup"
mount -t cgroup2 none "$root/sys/fs/cgroup"
mount -t tmpfs tmpfs "$root/run"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
mount --rbind /dev "$root/dev"
mkdir -p "$root/shared"
mount --bind "$folder/shared" "$root/shared"
mkdir -p "$folder/shared/journal" "$root/var/log/journal" "$root/etc/systemd/journald.conf.d"
mount --bind "$folder/shared/journal" "$root/var/log/journal"
printf '[Journal]\nStorage=persistent\n' >"$root/etc/systemd/journald.conf.d/test.conf"
exec unshare --cgroup chroot "$root" /usr/bin/env -i container=robotont PATH=/usr/bin:/usr/sbin:/bin:/sbin \
    /lib/systemd/systemd --system "--unit=$unit" --log-level=info --show-status=false
