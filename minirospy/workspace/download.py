"""``catkin_download()`` and ``catkin_download_test_data()``: files that a package's build or its tests download.

Source: http://docs.ros.org/en/noetic/api/catkin/html/dev_guide/generated_cmake_api.html.
"""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Iterable
from pathlib import Path

from minirospy.base.errors import BuildError
from minirospy.workspace.plan import Download, Plan

__all__ = ["download"]

_TIMEOUT = 30.0  # maximum seconds without receiving any data from the server


def download(plan: Plan, wanted: Iterable[Download]) -> None:
    """Download the files that are missing or have the wrong MD5 sum. Print one line per download.

    Raise BuildError if a REQUIRED file cannot be downloaded, or if a downloaded file has the wrong MD5 sum.
    """
    for each in wanted:
        if _is_right(each):
            continue
        try:
            _fetch(each)
        except (OSError, ValueError) as error:
            if each.required:
                raise BuildError(
                    str(plan.cmake_lists), each.line, f"cannot download {each.url}: {error}"
                ) from error
            print(f"Downloading {each.url} to {each.path}... failed ({error})!", flush=True)
            continue
        print(f"Downloading {each.url} to {each.path}... done.", flush=True)
        if not _is_right(each):
            raise BuildError(
                str(plan.cmake_lists), each.line, f"{each.url} has another MD5 sum than {each.md5}"
            )


def _is_right(wanted: Download) -> bool:
    """Return whether a file exists and, if its MD5 sum is given, has this sum."""
    if not wanted.path.is_file():
        return False
    if not wanted.md5:
        return True
    digest = hashlib.md5(usedforsecurity=False)
    with wanted.path.open("rb") as file:
        while block := file.read(1 << 20):
            digest.update(block)
    return digest.hexdigest() == wanted.md5.lower()


def _fetch(wanted: Download) -> None:
    """Download a file under a temporary name, and rename it when it is complete."""
    # Import these modules here, because importing them takes as long as a whole build without downloads.
    from http.client import HTTPException
    from urllib.request import Request, urlopen

    wanted.path.parent.mkdir(parents=True, exist_ok=True)
    part = wanted.path.with_name(f"{wanted.path.name}.part")
    url = wanted.url if "://" in wanted.url else Path(wanted.url).absolute().as_uri()
    try:
        with urlopen(Request(url), timeout=_TIMEOUT) as source, part.open("wb") as target:
            shutil.copyfileobj(source, target)
            missing = getattr(source, "length", None)
        if missing:
            raise OSError(f"the connection was closed {missing} bytes before the end")
        os.replace(part, wanted.path)
    except HTTPException as error:
        raise OSError(f"the response is not HTTP, or incomplete ({type(error).__name__}: {error})") from error
    finally:
        part.unlink(missing_ok=True)
