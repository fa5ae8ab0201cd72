"""What the researcher sees, and what the token opens."""

import io
import json
import urllib.error
import urllib.request
import zipfile

from qbumpers.study.flow.researcher import overview
from tests.study.flow.studies import Participant, block, served_study, study_of


def test_people_counts_and_curves(tmp_path):
    study = study_of(block("pretest"), block("training", 2, probe_every=1))
    with served_study(study, tmp_path / "pilot.sqlite") as (address, host):
        with Participant(address) as page:
            page.enter()
            page.go(agree=True)
            page.rest()
            page.rest()
            page.send(type="ping", at=5.0, last=12.5)
            page.next("pong")
            with Participant(address) as other:
                other.enter()
                found = overview(host)
            condition = next(
                person["condition"] for person in found["people"] if person["condition"]
            )
            assert [(p["part"], p["here"], p["latency"]) for p in found["people"]] == [
                ("debriefing", True, 12.5),
                ("consent", True, None),
            ]
            counts = {row["condition"]: row["ongoing"] for row in found["counts"]}
            assert counts == {"not assigned yet": 1, "alone": 0, "helped": 0, condition: 1}
            assert [(row["episode"], row["assisted"]) for row in found["curves"]] == [
                (0, True), (1, False), (2, True), (3, False),
            ]  # fmt: skip
            assert {row["mean"] for row in found["curves"]} == {-4.0}
            page.go()
        assert overview(host)["drop_out"] == 0


def answer(address, path, token=""):
    """Status and content of an answer."""
    headers = {"Authorization": f"Bearer {token}"} if token else {}
    request = urllib.request.Request(f"http://{address}{path}", headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=20) as found:
            return found.status, found.read()
    except urllib.error.HTTPError as error:
        return error.code, error.read()


def test_the_token_opens_the_export_and_another_does_not(tmp_path):
    study = study_of(block("training", 2, probe_every=1))
    with served_study(study, tmp_path / "pilot.sqlite") as (address, host):
        with Participant(address) as page:
            page.enter()
            page.go(agree=True)
            page.rest()
            page.go()
        for path in ("/researcher/data", "/researcher/export"):
            assert answer(address, path)[0] == 403
            assert answer(address, path, "guess")[0] == 403
            assert answer(address, f"{path}?token={host.token}")[0] == 403
        people = json.loads(answer(address, "/researcher/data", host.token)[1])["people"]
        assert people[0]["state"] == "complete"
        content = answer(address, "/researcher/export", host.token)[1]
    names = zipfile.ZipFile(io.BytesIO(content)).namelist()
    assert {"dataset/dataset_description.json", "episodes.parquet"} <= set(names)
