# SPDX-License-Identifier: MIT
# Sourced by ./run, ./test and .ci/run: packages, lock, log, build. Prints only to stderr; changes no folder.
# Sets kiln_root; the caller sets kiln_name (who speaks) and kiln_log (where details go).

kiln_root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")/.." && pwd -P)

say() { printf '%s: %s\n' "$kiln_name" "$*" >&2; }

# Runs a command with its words in the log and nothing to read from.
logged() {
    printf '\n+ %s\n' "$*" >>"$kiln_log"
    "$@" </dev/null >>"$kiln_log" 2>&1 9>&-
}

# fail SENTENCE: says so, names the log, ends.
fail() {
    say "$1; see $kiln_log"
    exit 1
}

# Waits until no other ./run or ./test builds here; the lock is held until this shell ends (the programs it starts do not hold it).
lock_build() {
    mkdir -p -- "$kiln_root/build" || { say "cannot make $kiln_root/build"; exit 1; }
    exec 9>"$kiln_root/build/.lock" || { say "cannot write to $kiln_root/build"; exit 1; }
    flock 9
}
unlock_build() { exec 9>&-; }

# The names of the packages in the groups $@.
packages_of() {
    local group
    for group in "$@"; do
        sed -n "s/^$group: *\([^ #]*\).*/\1/p" "$kiln_root/tools/packages.txt"
    done
}

# ensure_packages GROUP…: installs what dpkg does not know yet. On a system without Debian's packages: says what to install, exits 1.
ensure_packages() {
    [ -n "${KILN_SKIP_PACKAGES:-}" ] && return 0
    local wanted missing=() name id='' version=''
    mapfile -t wanted < <(packages_of "$@")
    if [ -r /etc/os-release ]; then
        id=$(. /etc/os-release && printf %s "${ID:-}")
        version=$(. /etc/os-release && printf %s "${VERSION_ID:-}")
    fi
    if [ "$id" != debian ] || ! [ "${version:-13}" -ge 12 ] 2>/dev/null || ! command -v apt-get >/dev/null; then
        say "this is not Debian 12 or later. Install what these Debian packages hold, then set KILN_SKIP_PACKAGES=1 and try again:"
        printf '  %s\n' "${wanted[@]}" >&2
        exit 1
    fi

    local -A present=()
    while read -r name; do present[$name]=1; done < <(
        dpkg-query -W -f='${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null | sed -n 's/^installed //p')
    for name in "${wanted[@]}"; do
        [ -n "${present[$name]:-}" ] || missing+=("$name")
    done
    [ ${#missing[@]} -eq 0 ] && return 0

    local as_root=(env DEBIAN_FRONTEND=noninteractive)
    if [ "$(id -u)" -ne 0 ]; then
        if ! command -v sudo >/dev/null; then
            say "packages are missing and there is no sudo. As root: apt-get install --no-install-recommends ${missing[*]}"
            exit 1
        fi
        if [ -t 2 ]; then as_root=(sudo "${as_root[@]}"); else as_root=(sudo -n "${as_root[@]}"); fi
    fi
    local apt=("${as_root[@]}" apt-get -y -q -o DPkg::Lock::Timeout=600 -o Acquire::Retries=3)
    # apt's own time-out does not cover the lock of its lists.
    local try start=$SECONDS
    for try in {1..60}; do
        : >"$kiln_root/build/.apt"
        printf '\n+ %s update\n' "${apt[*]}" >>"$kiln_log"
        if "${apt[@]}" update </dev/null >"$kiln_root/build/.apt" 2>&1 9>&-; then
            cat "$kiln_root/build/.apt" >>"$kiln_log"
            break
        fi
        cat "$kiln_root/build/.apt" >>"$kiln_log"
        grep -q 'Could not get lock' "$kiln_root/build/.apt" || break
        sleep 5
    done
    rm -f "$kiln_root/build/.apt"
    logged "${apt[@]}" install --no-install-recommends "${missing[@]}" || fail "installing ${#missing[@]} packages failed"
    printf '\n%s packages in %s s\n' "${#missing[@]}" "$((SECONDS - start))" >>"$kiln_log"
}

# configure PRESET [cmake words…]: cmake --preset, again from nothing when the folder was made elsewhere.
configure() {
    local preset=$1
    shift
    local cache=$kiln_root/build/$preset/CMakeCache.txt fresh=()
    if [ -f "$cache" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$kiln_root" "$cache"; then fresh=(--fresh); fi
    (cd -- "$kiln_root" && logged cmake --preset "$preset" "${fresh[@]}" "$@")
}

# Everything `kiln` is made from, relative to the root.
kiln_inputs=(CMakeLists.txt CMakePresets.json cmake include src apps samples scenes tools)

# True where build/release holds a program made from the sources as they are now. Any change of a file, also its removal, renaming
# or replacement by an older one, changes the time of the file's or its folder's record.
up_to_date() {
    local stamp=$kiln_root/build/release/.up_to_date made_for='' inputs=() input
    [ -x "$kiln_root/build/release/bin/kiln" ] && [ -f "$stamp" ] || return 1
    read -r made_for <"$stamp"
    [ "$made_for" = "$kiln_root" ] || return 1
    for input in "${kiln_inputs[@]}"; do
        if [ -e "$kiln_root/$input" ]; then inputs+=("$kiln_root/$input"); fi
    done
    [ -z "$(find "${inputs[@]}" -cnewer "$stamp" -print -quit 2>&1)" ]
}

# build_release [cmake words… --] [targets…]: configures and builds, and stamps the result with the time it began.
build_release() {
    local words=()
    while [ $# -gt 0 ] && [ "$1" != -- ]; do words+=("$1"); shift; done
    [ $# -gt 0 ] && shift
    local folder=$kiln_root/build/release start=$SECONDS targets=()
    [ $# -gt 0 ] && targets=(--target "$@")
    mkdir -p -- "$folder" && rm -f -- "$folder/.up_to_date" && printf '%s\n' "$kiln_root" >"$folder/.building" || fail "cannot write to $folder"
    configure release "${words[@]}" || fail "setting up the build failed"
    logged cmake --build "$folder" "${targets[@]}" || fail "the build failed"
    mv -f -- "$folder/.building" "$folder/.up_to_date"
    printf '\nbuilt in %s s\n' "$((SECONDS - start))" >>"$kiln_log"
}
