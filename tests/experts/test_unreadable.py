"""Models of Stable-Baselines3 that cannot be read say why in one line."""

import base64
import json
import pickle
import sys
import types
import zipfile

import pytest
import stable_baselines3
from stable_baselines3 import DQN, PPO

from qbumpers.errors import RequestError
from qbumpers.experts import from_stable_baselines
from qbumpers.tasks import make_task
from qbumpers.values import load_values

HERE = stable_baselines3.__version__


@pytest.fixture(scope="module")
def task():
    return make_task("CartPole-v1", discount=0.99)


def save(algorithm, path, **settings):
    algorithm(
        "MlpPolicy", "CartPole-v1", device="cpu", policy_kwargs={"net_arch": [4]}, **settings
    ).save(path)
    return path


def changed(path, **members):
    """A copy of a model's file with other members; None leaves one out."""
    copy = path.with_name(f"changed-{path.name}")
    with zipfile.ZipFile(path) as old, zipfile.ZipFile(copy, "w") as new:
        for name in old.namelist():
            content = members.pop(name.replace(".", "_"), old.read(name))
            if content is not None:
                new.writestr(name, content)
    assert not members
    return copy


def pickled_from(module_name):
    """As a model's file keeps an object of a class of some module that is not here."""
    module = types.ModuleType(module_name)
    exec("class Box: pass", module.__dict__)
    sys.modules[module_name] = module
    try:
        kept = base64.b64encode(pickle.dumps(module.Box())).decode()
    finally:
        del sys.modules[module_name]
    return {":type:": f"<class '{module_name}.Box'>", ":serialized:": kept}


@pytest.fixture(scope="module")
def saved(tmp_path_factory):
    return save(DQN, tmp_path_factory.mktemp("saved") / "model.zip", buffer_size=10)


def data_of(path, **changes):
    with zipfile.ZipFile(path) as archive:
        return json.dumps({**json.loads(archive.read("data")), **changes})


def test_a_model_from_before_gymnasium_names_its_cause(task, saved):
    data = data_of(saved, observation_space=pickled_from("gym"))
    old = changed(saved, data=data, _stable_baselines3_version=b"1.6.2")
    with pytest.raises(
        RequestError,
        match=r"changed-model\.zip: saved by Stable-Baselines3 1\.6\.2, which used gym",
    ):
        from_stable_baselines(old, task)


def test_a_model_that_needs_a_module_of_its_program_names_it(task, saved):
    data = data_of(saved, action_noise=pickled_from("my_own_noise"))
    with pytest.raises(RequestError, match=r"a module 'my_own_noise' that is not here"):
        from_stable_baselines(changed(saved, data=data), task)


def test_a_model_of_a_newer_version_names_it(task, saved):
    newer = changed(saved, data=b"{}", _stable_baselines3_version=b"99.1.0")
    with pytest.raises(RequestError, match=rf"saved by .* 99\.1\.0, which {HERE} cannot read"):
        from_stable_baselines(newer, task)


def test_a_model_of_another_algorithm_names_its_policy(task, tmp_path):
    path = save(PPO, tmp_path / "ppo.zip")
    with pytest.raises(RequestError, match=r"policy comes from stable_baselines3\.common\.polic"):
        from_stable_baselines(path, task)


def test_a_file_that_was_cut_short_says_so(task, saved):
    content = saved.read_bytes()
    for length in (0, 100, len(content) // 2, len(content) - 5):
        cut = saved.with_name("cut.zip")
        cut.write_bytes(content[:length])
        with pytest.raises(RequestError, match=r"cut\.zip: not a DQN .*no zip file, or was cut"):
            from_stable_baselines(cut, task)
    for name in ("data", "policy_pth"):
        with pytest.raises(RequestError, match=r"changed-model\.zip: not a DQN of"):
            from_stable_baselines(changed(saved, **{name: None}), task)
    with pytest.raises(RequestError, match=r"changed-model\.zip: not a DQN of"):
        from_stable_baselines(changed(saved, policy_pth=b"no tensors"), task)


def test_a_model_in_place_of_values_says_what_to_do(saved):
    with pytest.raises(RequestError, match=r"values file .*: a model of Stable-Baselines3; conv"):
        load_values(saved)
