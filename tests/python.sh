#!/usr/bin/env bash
# The Python package: builds the wheel, installs it into a clean environment and runs its tests from there, outside the source tree.
#
#   bash tests/python.sh              needs Python 3.10 or later and its packages (maturin, NumPy, pytest, scikit-learn, Gymnasium)
#   bash tests/python.sh --measure    sizes and times too
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
target=${CARGO_TARGET_DIR:-$here/target}/python
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT

python=${PYTHON:-python3}
if ! "$python" -c 'import sys, venv; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then
    echo "SKIPPED the Python package: no Python 3.10 or later"
    exit 0
fi
"$python" -m venv "$place/build"
if ! "$place/build/bin/pip" install -q maturin >"$place/log" 2>&1; then
    echo "SKIPPED the Python package: pip cannot install maturin ($(tail -n 1 "$place/log"))"
    exit 0
fi
(cd "$here/python" && CARGO_TARGET_DIR=$target "$place/build/bin/maturin" build --release --locked --out "$place/wheels" 2>&1 | tail -n 3)
wheel=$(ls "$place"/wheels/*.whl)
size=$(stat -c %s "$wheel")
echo "wheel: $(basename "$wheel"), $size bytes"
[[ $size -lt 50000000 ]] || { echo "a wheel of 50 MB or more" && exit 1; }

"$python" -m venv "$place/clean"
if ! "$place/clean/bin/pip" install -q pytest "scikit-learn>=1.6" "gymnasium>=1.1" >"$place/log" 2>&1; then
    echo "SKIPPED the Python package: pip cannot install its tests' packages ($(tail -n 1 "$place/log"))"
    exit 0
fi
"$place/clean/bin/pip" install -q "$wheel"
if [[ ${1:-} == --measure ]]; then
    "$place/clean/bin/python" "$here/python/tests/measure.py"
fi
mkdir "$place/apart" # beside the environment: tests refuse a package that lies about them, which would be the source
cp -r "$here/python/tests" "$here/python/stubs.py" "$place/apart"
cd "$place/apart"
DALEAN_EXAMPLES="$here/examples/python" "$place/clean/bin/python" -m pytest -q -p no:cacheprovider "$place/apart/tests"
