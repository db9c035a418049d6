# SPDX-License-Identifier: Apache-2.0
"""Keeps measurements in a folder, so that an interrupted run continues where it stopped."""
import functools
import hashlib
import json
import os
import time


@functools.lru_cache(maxsize=None)
def _hash_of(path, _size, _changed):
    digest = hashlib.sha256()
    with open(path, "rb") as file:
        while part := file.read(1 << 20):
            digest.update(part)
    return digest.hexdigest()[:20]


def content_hash(path):
    """Hash of a file's content."""
    status = os.stat(path)
    return _hash_of(os.path.abspath(path), status.st_size, status.st_mtime_ns)


def key_hash(key):
    """Hash of a key: JSON values in dictionaries and lists."""
    return hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()[:20]


def write_json(path, content):
    """Writes the file as a whole or, if it is interrupted, not at all."""
    with open(path + ".part", "w", encoding="utf-8") as file:
        json.dump(content, file)
    os.replace(path + ".part", path)


class Store:
    """One file for each measurement, named by a hash of its key. The key must hold everything on which the result
    depends. With `again`, nothing that is already in the folder is used. Without a folder, nothing is kept."""

    def __init__(self, folder=None, again=False):
        self.folder, self.again = folder, again
        self.seconds = 0.0  # that the results since the last reset() took, when they were measured
        self.written = set()
        if folder:
            os.makedirs(folder, exist_ok=True)

    def reset(self):
        self.seconds = 0.0

    def get(self, key, measure):
        """The kept result for this key or, if there is none, that of measure(), which is kept."""
        path = os.path.join(self.folder, key_hash(key) + ".json") if self.folder else None
        # A key that is asked for twice in one run is a measurement that was repeated by mistake or on purpose.
        if path and os.path.exists(path) and not (self.again and path not in self.written):
            with open(path, encoding="utf-8") as file:
                kept = json.load(file)
        else:
            begin = time.monotonic()
            kept = {"key": key, "result": measure(), "seconds": 0.0}
            kept["seconds"] = time.monotonic() - begin
            if path:
                write_json(path, kept)
                self.written.add(path)
        self.seconds += kept["seconds"]
        return kept["result"]
