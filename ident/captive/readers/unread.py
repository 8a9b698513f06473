"""Formats that are not read, by what their files begin with, so that they are refused by their name."""

from __future__ import annotations

# So many bytes of a file tell.
BEGINNING = 300
_TAR = 257
_BINARY = {
    b"PK\x03\x04": "a spreadsheet (xlsx, ods) or another archive",
    b"\xd0\xcf\x11\xe0": "an Excel workbook (xls)",
    b"\x89HDF": "an HDF5 or MATLAB 7.3 file",
    b"MATLAB 5": "a MATLAB file",
    b"TDSm": "a LabVIEW TDMS file",
    b"%PDF": "a PDF",
    b"\xff\xd8\xff": "a JPEG picture",
    b"\x89PNG": "a PNG picture",
    b"GIF8": "a GIF picture",
    b"Rar!": "a RAR archive",
    b"7z\xbc\xaf": "a 7-Zip archive",
    b"{\\rtf": "an RTF document",
    b"\x28\xb5\x2f\xfd": "a Zstandard archive",
    b"\x93NUMPY": "an array of NumPy (npy)",
    b"\x80\x03": "a pickle of Python",
    b"\x80\x04": "a pickle of Python",
    b"\x80\x05": "a pickle of Python",
    b"ARROW1": "a Feather file of Arrow",
    b"SQLite format 3": "a database of SQLite",
    b"#!TDV": "a binary file of Tecplot (plt)",
    b"#!SZPLT": "a binary file of Tecplot (szplt)",
    b"<?xml": "an XML document (a workbook saved as XML among them)",
    b"<!DOCTYPE html": "an HTML page (a workbook saved as HTML among them)",
    b"<!doctype html": "an HTML page (a workbook saved as HTML among them)",
    b"<html": "an HTML page (a workbook saved as HTML among them)",
    b"<table": "an HTML page (a workbook saved as HTML among them)",
    b"Auto-Transcript Start Time": "a transcript of Fluent (its report files are read)",
    b'{"': "a JSON document",
    b'[{"': "a JSON document",
    b"CDF\x01": "a netCDF file",
    b"CDF\x02": "a netCDF file",
    b"SIMPLE  ": "a FITS file",
    b"OggS": "a sound file",
    b"RIFF": "a sound or film file",
}


def unread(start: bytes) -> str:
    """What a file is that is no text, in words; empty for text, or for what is not known.

    Parameters
    ----------
    start : The first ``BEGINNING`` bytes.

    Examples
    --------
    >>> unread(b"%PDF-1.7")
    'a PDF'
    """
    if start[_TAR:].startswith(b"ustar"):
        return "a tar archive"
    begin = start.removeprefix(b"\xef\xbb\xbf").lstrip(b" \t\r\n")
    return next((kind for mark, kind in _BINARY.items() if begin.startswith(mark)), "")
