"""Arrays of HDF5 files that may come from anywhere: every byte of them is in the file itself.

An HDF5 file may name other files, by links, by external storage and by virtual datasets, and claim arrays without storing them. All
that is refused: reading a file reads nothing else, and takes no more memory than the file has bytes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import h5py

#: what reading a bad file raises
DAMAGE = (OSError, LookupError, MemoryError, RuntimeError, ValueError, TypeError, AttributeError)


def member(group: h5py.Group, name: str) -> h5py.Group | h5py.Dataset:
    """What stands under a name in a group of this file itself; ValueError for links to elsewhere."""
    import h5py

    link = group.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):
        raise ValueError(f"'{name}' that is {'not there' if link is None else 'a link to elsewhere'}")
    return group[name]


def array(group: h5py.Group, name: str) -> np.ndarray:
    """The numbers under a name, whose every byte is in the file; ValueError where they are elsewhere, or nowhere."""
    import h5py

    item = member(group, name)
    if not isinstance(item, h5py.Dataset) or item.dtype.kind not in "biuf":
        raise ValueError(f"'{name}' that is no array of numbers")
    if item.external or item.is_virtual:
        raise ValueError(f"'{name}' whose numbers are in another file")
    if item.id.get_storage_size() < item.nbytes:
        raise ValueError(f"'{name}' of {item.nbytes} bytes of {item.dtype}, of which {item.id.get_storage_size()} are stored")
    return np.asarray(item[()])
