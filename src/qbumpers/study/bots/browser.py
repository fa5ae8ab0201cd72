"""A simulated learner in a real browser: it reads what the page is sent, and presses keys."""

import asyncio
import json
import shutil
from collections.abc import Mapping
from typing import Any
from urllib.parse import urlencode

from qbumpers.errors import RequestError
from qbumpers.study.bots.page import Taken
from qbumpers.study.bots.person import Person

FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")
"""With which Chromium is started."""

_ASKED_WITHIN = 0.05  # seconds after a state


async def by_browser(address: str, person: Person, arrival: Mapping[str, str]) -> Taken:
    """Take part through Chromium, see `qbumpers.study.bots.rehearsing.TakePart`.

    Raises:
        RequestError: if Chromium or Playwright is not installed.
    """
    try:
        from playwright.async_api import async_playwright
    except ImportError as error:
        raise RequestError("--browser: playwright is missing; pip install playwright") from error
    found = shutil.which("chromium")
    if found is None:
        raise RequestError("--browser: there is no program chromium")
    async with async_playwright() as running:
        browser = await running.chromium.launch(executable_path=found, args=list(FLAGS))
        page = await browser.new_page()
        try:
            return await _BrowserPage(page, person).take_part(address, arrival)
        finally:
            await browser.close()


class _BrowserPage:
    """A page in a browser, and what its server says."""

    def __init__(self, page: Any, person: Person) -> None:
        self._page, self._person = page, person
        self._heard: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._shown: dict[str, Any] = {}
        self._keys: list[str] = []
        page.set_default_timeout(20_000)
        page.on("websocket", self._listen)

    async def take_part(self, address: str, arrival: Mapping[str, str]) -> Taken:
        """Go through the study until it ends, or they leave."""
        await self._page.goto(f"http://{address}/?{urlencode(arrival)}")
        token, reloads = "", 0
        while True:
            message = await asyncio.wait_for(self._heard.get(), 60)
            if message["type"] == "welcome":
                token = message["token"]
            elif message["type"] == "page":
                self._shown = message["page"]
                leaves = self._shown["number"] == self._person.habits.drops_at
                if self._shown["kind"] == "end":
                    return Taken(self._shown["id"], token, reloads, self._shown.get("code", ""))
                if leaves:
                    return Taken("dropped out", token, reloads, "")
                await self._turn_page()
            else:
                await self._play(message)
            if self._person.chance.random() < self._person.habits.reloads:
                reloads += 1
                self._heard = asyncio.Queue()
                await self._page.reload()

    def _listen(self, socket: Any) -> None:
        heard = self._heard

        def take(text: str | bytes) -> None:
            heard.put_nowait(json.loads(text))

        socket.on("framereceived", take)

    async def _turn_page(self) -> None:
        page, kind = self._page, self._shown["kind"]
        if kind == "sitting":
            await page.wait_for_timeout(50)
            await page.reload()
        elif kind != "block":
            await page.wait_for_function(
                "title => document.getElementById('heading').textContent === title",
                arg=self._shown["title"],
            )
            answer = self._person.answer(self._shown)
            for item in self._shown.get("items", []):
                await self._fill(item, answer[item["id"]])
            await page.click("#form button.primary")

    async def _fill(self, item: Mapping[str, Any], value: Any) -> None:
        """Answer an item by its label."""
        page = self._page
        if item["kind"] == "choice":
            group = page.get_by_role("group", name=item["text"])
            await group.get_by_label(value, exact=True).check()
        elif item["kind"] == "scale" and (item["most"] - item["least"]) / item["step"] <= 10:
            group = page.get_by_role("group", name=item["text"])
            await group.get_by_label(f"{value:g}", exact=True).check()
        else:
            await page.get_by_label(item["text"]).fill(str(value))

    async def _play(self, message: dict[str, Any]) -> None:
        page, kind = self._page, message["type"]
        if kind == "board":
            keys: dict[str, int] = message["task"]["keys"]
            self._keys = [
                next(key for key, which in keys.items() if which == action)
                for action in range(len(message["task"]["actions"]))
            ]
            await page.wait_for_selector(
                "#choices button:visible, #overlay[hidden]", state="attached"
            )
            if self._shown["over"] or not self._going_on():
                await page.click("#choices button.primary")
        elif kind == "state":
            action = self._person.play(self._shown["id"], message)
            if action is None:
                await page.click("#choices button.primary")
            else:
                await page.wait_for_function(
                    "step => document.getElementById('step').textContent === String(step)",
                    arg=message["episode"]["length"],
                )
                await self._answer_if_asked()
                await page.keyboard.press(self._keys[action])

    async def _answer_if_asked(self) -> None:
        """Whose move it was, if that is asked: it comes right after a state."""
        await asyncio.sleep(_ASKED_WITHIN)
        waiting: list[dict[str, Any]] = list(self._heard._queue)  # type: ignore[attr-defined]
        if not waiting or waiting[0]["type"] != "ask":
            return
        self._heard.get_nowait()
        chosen = {"me": 1, "assistant": 2, "unsure": 3}[self._person.attribution()]
        await self._page.click(f"#choices button:nth-child({chosen})")
        await self._page.wait_for_selector("#overlay", state="hidden")

    def _going_on(self) -> bool:
        """Whether the state of an episode that goes on has been sent already."""
        waiting: list[dict[str, Any]] = list(self._heard._queue)  # type: ignore[attr-defined]
        return any(each["type"] == "state" for each in waiting)
