#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""validate.py SCHEMA FILE: whether a JSON file fits a schema of results/ (draft 7); schemas beside it may be referred
to."""
import json
import pathlib
import sys
import urllib.parse

import jsonschema


def main() -> int:
    path, file = pathlib.Path(sys.argv[1]).resolve(), sys.argv[2]
    store = {}
    for other in path.parent.glob("*.schema.json"):
        document = json.loads(other.read_text(encoding="utf-8"))
        store[other.as_uri()] = document
        if "$id" in document:
            store[urllib.parse.urljoin(other.as_uri(), document["$id"])] = document
    schema = store[path.as_uri()]
    jsonschema.Draft7Validator.check_schema(schema)
    resolver = jsonschema.RefResolver(path.as_uri(), schema, store=store)
    value = json.loads(pathlib.Path(file).read_text(encoding="utf-8"))
    errors = list(jsonschema.Draft7Validator(schema, resolver=resolver).iter_errors(value))
    for error in errors[:10]:
        print("/" + "/".join(map(str, error.absolute_path)) + ": " + error.message[:300])
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
