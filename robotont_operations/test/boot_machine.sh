#!/bin/sh
# Boots systemd on a copy-on-write view of this machine, without a network.
# $1: an empty folder; $2: file system tree laid over the root, with what is installed; $3: the unit to boot into;
# $4 and on: the repository and the workspace, which may lie in /tmp or on a disk of its own.
# The booted machine finds $1/shared as /shared, and leaves its journal in /shared/journal. Run by test_boot.py in new
# namespaces for mounts, processes, the network, host name and interprocess communication, and in a new control group.
set -eu
folder=$1
tree=$2
unit=$3
shift 3
mkdir -p "$folder/layer" "$folder/root" "$folder/shared"
mount -t tmpfs tmpfs "$folder/layer"
mkdir "$folder/layer/upper" "$folder/layer/work"
mount -t overlay overlay -o "lowerdir=/,upperdir=$folder/layer/upper,workdir=$folder/layer/work" "$folder/root"
root=$folder/root
cp -a "$tree/." "$root/"
rm -rf "$root"/etc/systemd/network "$root"/var/lib/robotont
mount -t proc proc "$root/proc"
mount -t sysfs -o ro sysfs "$root/sys"
mount -t cgroup2 none "$root/sys/fs/cgroup"
mount -t tmpfs tmpfs "$root/run"
mount -t tmpfs -o mode=1777 tmpfs "$root/tmp"
for place; do
    mkdir -p "$root$place"
    mount --bind "$place" "$root$place"
    mount -o remount,bind,ro "$root$place"
done
mount -t tmpfs tmpfs "$root/dev"  # a few devices of its own: nothing that is booted shall reach this machine's
for device in null zero full random urandom tty; do
    touch "$root/dev/$device"
    mount --bind "/dev/$device" "$root/dev/$device"
done
mkdir "$root/dev/pts" "$root/dev/shm"
mount --bind /dev/pts "$root/dev/pts"
mount --bind "$root/proc/sys" "$root/proc/sys"
mount -o remount,bind,ro "$root/proc/sys"  # nor its kernel's settings
mkdir -p "$root/shared"
mount --bind "$folder/shared" "$root/shared"
mkdir -p "$folder/shared/journal" "$root/var/log/journal" "$root/etc/systemd/journald.conf.d"
mount --bind "$folder/shared/journal" "$root/var/log/journal"
printf '[Journal]\nStorage=persistent\n' >"$root/etc/systemd/journald.conf.d/test.conf"
date +%s.%N >"$folder/shared/booted"
exec chroot "$root" /usr/bin/env -i container=robotont PATH=/usr/bin:/usr/sbin:/bin:/sbin \
    /lib/systemd/systemd --system "--unit=$unit" --log-level=info --show-status=false
