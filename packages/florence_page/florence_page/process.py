"""The page as a process of ``florence up``: a node that nothing depends on."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from florence_bt.core.limits import CheckedParameters, Limits
from florence_bt.ros.node import FlorenceNode
from florence_page.access import check_page, user_access
from florence_page.ros_thread import RosThread
from florence_page.server import make_server

END_S = 5.0
"""Wall seconds that viewers get to leave."""


@dataclass(frozen=True, slots=True)
class PageParameters(CheckedParameters):
    """The address of the page, and the journal that it shows.

    Attributes:
        host: The address that is bound; one that others can reach needs tokens (``florence page --token``).
        port: The TCP port.
        runs_folder: The folder of the journal that is shown.
    """

    host: str = "127.0.0.1"
    port: Annotated[int, Limits(1, 65535)] = 8080
    runs_folder: str = "runs"


class PageServerNode(FlorenceNode):
    """Serves the page, with a node and a thread of its own, as ``florence page`` does.

    Args:
        parameters: Overrides of the node's parameters.

    Raises:
        ConfigError: Others could reach the page without a token, or the port is taken.
    """

    parameter_classes = (PageParameters,)

    def __init__(self, *, parameters: Mapping[str, Any] | None = None) -> None:
        super().__init__("page_server", parameters=parameters)
        params = self.read_parameters(PageParameters)
        access = user_access()
        check_page(params.host, params.port, access)
        self._ros = RosThread()
        self._server = make_server(self._ros, params.host, params.port, access, Path(params.runs_folder))
        self._thread = threading.Thread(target=self._serve, name="page", daemon=True)
        self.on_close(self._end)
        self._thread.start()

    def _serve(self) -> None:
        try:
            self._server.run()
        finally:
            if not self._server.should_exit:
                self.get_logger().error("the page has ended by itself")
                os.kill(os.getpid(), signal.SIGTERM)

    def _end(self) -> None:
        self._server.should_exit = True
        self._thread.join(END_S)
        self._ros.close()
