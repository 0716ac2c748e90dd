"""The processes that work for the editor: an answer belongs to its question."""

from __future__ import annotations

import asyncio

from florence_bt.app.page.editor.helpers import Worker

TEXT = "mission: {name}\ntree:\n  wait: 1 s\n"


def test_a_question_that_was_given_up_leaves_no_answer_for_the_next_one():
    async def go():
        worker = Worker()

        async def rows(name):
            look = await worker.ask("look", (), None, text=TEXT.format(name=name), name=name)
            return look["outline"]

        try:
            before = await rows("first")
            asked = asyncio.create_task(rows("second"))
            await asyncio.sleep(0)  # it has written its question
            asked.cancel()
            await asyncio.gather(asked, return_exceptions=True)
            return before, await rows("third"), await rows("fourth")
        finally:
            await worker.close()

    first, third, fourth = asyncio.run(go())
    assert "first" in str(first) and "third" in str(third) and "fourth" in str(fourth)
