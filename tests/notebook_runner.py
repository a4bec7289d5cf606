"""Runs the notebooks of the examples in kernels of their own. As a script it writes the outputs into the notebooks:

python tests/notebook_runner.py
"""

import asyncio
import os
import sys
import warnings
from pathlib import Path

import nbformat

NOTEBOOKS = sorted((Path(__file__).parent.parent / "examples").glob("*.ipynb"))


def executed(path: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of all cells, run in order by the interpreter that runs this."""
    from nbclient import NotebookClient

    notebook = nbformat.read(path, as_version=4)
    for cell in notebook.cells:
        if cell.cell_type == "code":
            cell.outputs, cell.execution_count = [], None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of zmq and asyncio, which are not ours to mend
        client = NotebookClient(notebook, timeout=110, kernel_name="python3", resources={"metadata": {"path": "."}})
        client.create_kernel_manager()
        client.km.transport = "ipc"
        client.km.kernel_cmd = [sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}"]
        asyncio.run(client.async_execute())
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # times
        if cell.cell_type == "code":  # what a progress bar leaves, if the cell took more than two seconds
            cell.outputs = [one for one in cell.outputs if one.get("data", {}).get("text/html") != ""]
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    return notebook


if __name__ == "__main__":
    os.environ.setdefault("PYDEVD_DISABLE_FILE_VALIDATION", "1")
    for path in NOTEBOOKS:
        nbformat.write(executed(path), path)
