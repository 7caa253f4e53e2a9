"""The list of all result files, docs/results.md."""
from blocks import Results, block, table
from provenance import provenance


@block
def results_list(results: Results) -> str:
    """Each file of bench/results with its commit, date and machine."""
    rows = [["file", "commit", "code", "date", "machine"]]
    for name in results.index:
        entry = provenance(results.root, name)
        before = "before " if entry["commit_is"] == "log" else ""
        rows.append([f"`{name}`", before + entry["commit"], "older" if entry.get("stale") else "today's", entry["date"], entry["machine"]])
    return table(rows)


@block
def results_commands(results: Results) -> str:
    """The commands that wrote each file, or wrote what it was made from."""
    parts = []
    for name in results.index:
        commands = [line.strip() for command in provenance(results.root, name)["command"] for line in command.split("\n")]
        parts.append("\n".join([f"    # {name}", *(f"    {line}" for line in commands)]))
    return "\n" + "\n\n".join(parts) + "\n"
