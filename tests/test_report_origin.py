"""Where a report comes from: every file of the study with its hash, the version, the seed and the command."""

import hashlib
from importlib.metadata import version
from types import SimpleNamespace

from bayesid.app.report_origin import report_origin


def test_the_origin_names_every_file_with_its_hash(tmp_path):
    files = [tmp_path / name for name in ("study.toml", "robot.urdf", "one.csv", "two.csv")]
    for file in files:
        file.write_text(file.name)
    study, urdf, *recordings = files
    made = SimpleNamespace(
        file=study,
        defining_files=[study, urdf, None],  # no earlier posterior
        recordings=[SimpleNamespace(file=file) for file in recordings],
    )
    hashes = [f"{file.name} {hashlib.sha256(file.name.encode()).hexdigest()[:12]}" for file in files]
    said = f"bayesid {version('bayesid')}, seed 7, command: bayesid diagnose"
    options = {
        "output": tmp_path / "my results",
        "samples": 2000.0,
        "wanted": None,
        "wanted_sd": ["a=1", "b=2"],
        "separate": ("rate-bias", "rate-scale"),
        "fly_next": False,
        "sample": True,
    }
    typed = "--output 'my results' --samples 2000 --wanted-sd a=1 --wanted-sd b=2 --separate rate-bias rate-scale "
    typed += "--no-fly-next --sample"
    found = report_origin(made, "diagnose", 7, **options)
    assert found == f"SHA-256: {', '.join(hashes)}. {said} study.toml --seed 7 {typed}"
    assert report_origin(made, "check", None).endswith("command: bayesid check study.toml")
    made.file, made.defining_files = None, [None, urdf]
    assert report_origin(made, "diagnose", 7) == f"SHA-256: {', '.join(hashes[1:])}. {said} --seed 7"
