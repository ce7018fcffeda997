#!/usr/bin/env bash
# pyNastran 1.4.1 cannot be installed from wheels on Python 3.13: it asks for NumPy 1, of which no version has a wheel for 3.13.
#
# Expected: a checker of Nastran decks installs beside today's NumPy, or says which Pythons it is for.
# Seen: its metadata holds no upper bound of Python; pip with wheels only finds none of the NumPy that it wants for Python 3.13 (for
# 3.12 it finds one). Without that restriction pip compiles NumPy 1.26 from its sources: more than ten minutes of a compiler, or an
# error where there is none, and everything else in the environment is held at NumPy 1.
# Who tests on 3.13 leaves pyNastran out there (our extra `dev` does).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder"
"$folder/bin/pip" install -q --disable-pip-version-check pip==25.3
cd "$folder"
bin/pip download -q --disable-pip-version-check --no-deps pyNastran==1.4.1
bin/python - <<'P'
import zipfile
from email.parser import Parser
from pathlib import Path

wheel = zipfile.ZipFile(next(Path().glob("py*astran*.whl")))
about = Parser().parsestr(wheel.read(next(n for n in wheel.namelist() if n.endswith("METADATA"))).decode())
wanted = [each for each in about.get_all("Requires-Dist") if each.lower().startswith("numpy")]
print("Requires-Python:", about["Requires-Python"], "| NumPy:", wanted)
assert "<" not in about["Requires-Python"], about["Requires-Python"]
assert any("<2" in each for each in wanted), wanted
P
resolved() { # whether wheels alone are enough for a version of Python
    bin/pip install -q --disable-pip-version-check --dry-run --only-binary=:all: --python-version "$1" --target "to$1" \
        "numpy<2" >"said$1" 2>&1
}
resolved 3.12
echo "Python 3.12: NumPy 1 from a wheel"
if resolved 3.13; then
    echo "Python 3.13 has a wheel of NumPy 1 now"
    exit 1
fi
grep -o "No matching distribution found for numpy<2" said3.13
