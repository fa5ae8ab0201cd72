"""What tests need that start Ray."""

import pytest

# Loopback only, and nothing written to the home folder. A cluster that is not started by RayCluster
# asks clouds whether it is one of theirs, and reports that it reports nothing: to a closed port.
NOWHERE = "http://127.0.0.1:9"
ALONE = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
    "RAY_AUTH_MODE": "disabled",
    "RAY_USAGE_STATS_ENABLED": "0",
    "RAY_USAGE_STATS_REPORT_URL": NOWHERE,
    "http_proxy": NOWHERE,
    "https_proxy": NOWHERE,
}

# Ray leaves sockets and files to the garbage collector, and starts threads before it forks.
MARKS = [
    pytest.mark.usefixtures("ray_alone"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
    pytest.mark.filterwarnings("ignore::FutureWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
]
