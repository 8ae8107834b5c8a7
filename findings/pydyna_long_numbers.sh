#!/bin/sh
# Numbers of nodes with nine digits, as preprocessors give them where parts have ranges of their own, in an LS-DYNA deck
# written by ansys-dyna-core 0.12.1 (PyDyna): the field of the standard format has eight columns, and what stands beyond
# is cut off without a word: neighbouring nodes get one number, which is also the number of another. The long format has
# twenty columns; there a number above 2^31 leaves the whole block of nodes an unread text, with a warning.
# Seen: 12345678 for 123456781 and for 123456789. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ansys-dyna-core==0.12.1

"$folder/env/bin/python" - <<'PYTHON'
import warnings

import pandas
from ansys.dyna.core import Deck, keywords

numbers = [123456781, 123456789]
node = keywords.Node()
node.nodes = pandas.DataFrame({"nid": numbers, "x": [0.0, 1.0], "y": [0.0, 0.0], "z": [0.0, 0.0]})
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    text = node.write()
deck = Deck()
deck.loads("*KEYWORD\n" + text + "\n*END\n")
back = deck.keywords[0].nodes["nid"].tolist()
print("standard format:", numbers, "->", back, "warnings:", len(said))
assert back == [12345678, 12345678] and not said, "changed: too long a number is refused or kept"

long = "".join(f"{number:20d}{0.0:20.12g}{0.0:20.12g}{0.0:20.12g}{0:20d}{0:20d}\n" for number in [123456789012])
deck = Deck()
with warnings.catch_warnings(record=True) as said:
    warnings.simplefilter("always")
    deck.loads("*KEYWORD LONG=Y\n*NODE\n" + long + "*END\n")
print("long format, twelve digits:", len(deck.keywords), "keywords,", len(deck.string_keywords), "texts;", said[-1].message if said else "")
assert not deck.keywords and len(deck.string_keywords) == 1, "changed: twelve digits are read"
PYTHON
echo "as described: digits beyond the eighth are cut off in writing"
