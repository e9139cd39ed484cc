#!/bin/sh
# setup.sh PACKAGE... [--optional PACKAGE...] [--meanwhile PACKAGE...] [--later PACKAGE...]: installs the Debian packages that are missing, but for those
# that the target installs while it compiles, and those that only other targets need: both are part of the command for those who have to ask
# somebody else to install.
# Silent and fast when there are none; touches no package lists then. Optional packages may be unknown to the system.
set -eu

command -v dpkg-query >/dev/null || exit 0 # not Debian: the configuration says what it misses

missing() {
  for package; do
    dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q '^install ok installed' || printf ' %s' "$package"
  done
}

required='' optional='' meanwhile='' later='' kind=required
for package; do
  case $package in
    --optional) kind=optional ;;
    --meanwhile) kind=meanwhile ;;
    --later) kind=later ;;
    *) eval "$kind=\"\$$kind $package\"" ;;
  esac
done
# shellcheck disable=SC2086
required=$(missing $required)
# shellcheck disable=SC2086
optional=$(missing $optional)
# shellcheck disable=SC2086
meanwhile=$(missing $meanwhile)
[ -n "$required$optional$meanwhile" ] || exit 0

if [ "$(id -u)" = 0 ]; then
  root=''
elif command -v sudo >/dev/null && sudo -n true 2>/dev/null; then
  root=sudo
elif [ -n "$required$meanwhile" ]; then
  echo 'setup: Debian packages are missing, and only root may install them; once:' >&2
  # shellcheck disable=SC2086
  install="apt-get update && apt-get install -y --no-install-recommends$required$optional$meanwhile$(missing $later)"
  if command -v sudo >/dev/null; then echo "sudo sh -c '$install'"; else echo "su -c '$install'"; fi
  exit 1
else
  echo "setup: not installed, what needs them is left out:$optional" >&2
  exit 0
fi

[ -n "$required$optional" ] || exit 0
apt() { $root env DEBIAN_FRONTEND=noninteractive apt-get -q -o Dpkg::Use-Pty=0 "$@" </dev/null; }

# A line for every tenth part of: packages fetched, unpacked, set up
progress() {
  awk '/ newly installed, / { all = 3 * ($1 + $3) }
       /^(Get:|Unpacking |Setting up )/ { if (all && int(10 * ++n / all) > part) { part = int(10 * n / all); if (part < 10) { print "setup: " 10 * part " %"; fflush() } } }'
}

log=$(mktemp)
trap 'rm -f "$log"' EXIT
# Lists of the last minutes are those of this target's first call. That a list could not be fetched is an error here, and makes the lists old again.
if [ -z "$(find /var/lib/apt/lists/partial -maxdepth 0 -mmin -20 2>/dev/null)" ]; then
  echo "setup: package lists"
  # A third party's broken list must not stop us: what counts is whether the packages can be installed.
  if ! apt -o APT::Update::Error-Mode=any update >"$log" 2>&1; then
    echo "setup: apt-get update failed, going on with the lists there are"
    cat "$log"
    $root touch -d '1 day ago' /var/lib/apt/lists/partial 2>/dev/null || true
  fi
fi
available() { apt install -s "$@" >/dev/null 2>&1; } # "apt-cache show" also knows packages that nobody offers any more
# shellcheck disable=SC2086
if [ -z "$optional" ] || available $optional; then # one question takes seconds
  required="$required$optional"
else
  for package in $optional; do
    if available "$package"; then
      required="$required $package"
    else
      echo "setup: $package is not to be had here, the tests that need it will be skipped"
    fi
  done
fi
[ -n "$required" ] || exit 0
echo "setup: installing$required"
{
  # shellcheck disable=SC2086
  apt install -y --no-install-recommends $required 2>&1 || echo 'setup: apt-get has failed'
} | tee "$log" | progress
if [ "$(tail -n 1 "$log")" = 'setup: apt-get has failed' ]; then
  cat "$log"
  exit 1
fi
