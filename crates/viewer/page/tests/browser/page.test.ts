import { test } from "node:test";
import assert from "node:assert/strict";
import { GRASP, picture, session } from "../examples.ts";
import { draw, launch, openPage } from "../harness.ts";

test("the page starts without an error", async () => {
  const browser = await launch();
  try {
    const server = await openPage(browser);
    server.send(session(GRASP));
    await draw(server, picture(GRASP, 0.1));
    assert.deepEqual(server.errors, []);
  } finally {
    await browser.close();
  }
});
