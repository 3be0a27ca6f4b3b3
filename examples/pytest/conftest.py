# SPDX-License-Identifier: MIT
pytest_plugins = ["cbcan_plant"]
