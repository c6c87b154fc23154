"""Results of Python readers for a description: numbers of measurements and parameters, and their complaints.

    python3 crates/stickslip/tests/interop/a2l.py bench.a2l      # pya2l 0.4.0 or pya2ldb 1.0.355

Both are imported as `pya2l`: each needs an environment of its own, and this takes the one that is there.
"""

import logging
import sys
import tempfile

import pya2l

# Names are paths here, no identifiers of C, and need not be short; 1.61 has no alignment of 64-bit integers.
FINE = ["exceeds 32 chars (ISO C90 limit)", "Missing ALIGNMENT(s): ['ALIGNMENT_INT64']"]

path = sys.argv[1]
complaints = []
handler = logging.Handler(logging.WARNING)
handler.emit = lambda record: complaints.append(record.getMessage())
logging.getLogger().addHandler(handler)

if hasattr(pya2l, "import_a2l"):
    from pya2l import model
    from pya2l.api.validate import Validator

    with tempfile.TemporaryDirectory() as folder:
        session = pya2l.import_a2l(path, in_memory=True, progress_bar=False, encoding="ascii", output_dir=folder, loglevel="WARNING")
        counts = [session.query(kind).count() for kind in (model.Measurement, model.Characteristic)]
        complaints += [message.text for message in Validator(session)()]
        name = "pya2ldb"
else:
    from pya2l.parser import A2lParser

    with A2lParser() as parser, open(path, "rb") as file:
        tree = parser.tree_from_a2l(file.read())
        (module,) = tree.PROJECT.MODULE
        counts = [len(module.MEASUREMENT), len(module.CHARACTERISTIC)]
        name = "pya2l"

print(name, *counts)
complaints = [text for text in complaints if not any(fine in text for fine in FINE)]
if complaints:
    sys.exit("\n".join(complaints))
