#!/usr/bin/env bash
# Runs a program for Linux on x86-64 on an emulated Sapphire Rapids: AVX-512 and AMX on any machine.
#
#   tests/emulate.sh PROGRAM ARGUMENTS...     ends with the program's own status
#   tests/emulate.sh --count PROGRAM ...      says how many instructions it was
#   tests/emulate.sh --self-test              instructions with known answers
#   tests/emulate.sh --fetch                  only gets the emulator
#
# tests/emulated.sh runs the kernels on it.
#
# Needs a C compiler and Python's pip: the processor is Bochs, out of a pinned wheel. See tests/emulate/emulate.h.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
source=$root/tests/emulate
build=${CARGO_TARGET_DIR:-$root/target}/emulate
mkdir -p "$build"
build=$(cd "$build" && pwd)
bochs=$build/bochscpu-0.4.0
wheel='bochscpu-python==0.4.0 --hash=sha256:08297de4c657fcda712c66745388cf81cd056e01083473c44868b96f6ea020ad'

# the library, for any Python: none is started with it
fetch() {
    [[ ! -e $bochs ]] || return 0
    rm -rf "$bochs.part"
    echo "$wheel" >"$build/wheel.txt"
    [[ -x $build/venv/bin/pip ]] || python3 -m venv "$build/venv"
    "$build/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps --require-hashes --only-binary=:all: \
        --implementation cp --python-version 3.11 --abi cp311 --platform manylinux_2_28_x86_64 \
        --target "$bochs.part" --requirement "$build/wheel.txt"
    mv "$bochs.part" "$bochs"
}

# what of Python the library names, it never calls here: each name gets a place and nothing else
compile() {
    local library=$bochs/bochscpu/_bochscpu.cpython-311-x86_64-linux-gnu.so
    nm --dynamic --undefined-only "$library" | awk '$2 ~ /^_?Py/ { print "char " $2 "[512];" }' >"$build/python.c"
    "${CC:-cc}" -std=gnu11 -O3 -g -Wall -Wextra -rdynamic -o "$build/emulate.part" \
        "$source"/{main,machine,amx,program,calls,threads}.c "$build/python.c" \
        "$library" -Wl,-rpath,"$(dirname "$library")" -ldl
    mv "$build/emulate.part" "$build/emulate"
}

newer() { [[ ! -e $1 || -n $(find "${@:2}" -newer "$1" -print -quit) ]]; }

# a case of the self test: how it is called, the status it must end with
ends_with() {
    local status=0
    "$build/emulate" "$build/known" ${1:+"$1"} >"$build/known.log" 2>&1 || status=$?
    [[ $status == "$2" ]] && return 0
    cat "$build/known.log"
    echo "self test ${1:-of known answers}: ended with $status, not with $2"
    return 1
}

fetch
[[ ${1:-} != --fetch ]] || exit 0
if newer "$build/emulate" "$source" "${BASH_SOURCE[0]}"; then compile; fi

if [[ ${1:-} == --self-test ]]; then
    "${CC:-cc}" -std=gnu11 -O1 -Wall -Wextra -pthread -o "$build/known" "$source/known.c"
    ends_with '' 0
    ends_with null 139
    ends_with undefined 132
    ends_with shapes 132
    ends_with abort 134
    ends_with wait 125
    echo 'self test: ok'
    exit
fi
exec "$build/emulate" "$@"
