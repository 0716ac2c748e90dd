"""The page as a process of ``florence up --page``."""

from __future__ import annotations

from typing import Any

from florence_bt.app.bringup.options import BringUp
from florence_bt.app.bringup.package_processes import PackageProcess
from florence_page.access import address_of, check_page, user_access


def _parameters(options: BringUp) -> dict[str, Any]:
    return {
        "host": options.page_host,
        "port": options.page_port,
        "runs_folder": str(options.runs.resolve()),
    }


PAGE = PackageProcess(
    name="page",
    node="page_server",
    node_class="florence_page.process:PageServerNode",
    is_wanted=lambda options: options.page_port != 0,
    parameters=_parameters,
    check=lambda options: check_page(options.page_host, options.page_port, user_access()),
    told=lambda options: f"the page: {address_of(options.page_host, options.page_port)}",
)
