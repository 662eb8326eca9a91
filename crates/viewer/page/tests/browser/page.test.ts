import { test } from "node:test";
import assert from "node:assert/strict";
import { encodePicture } from "../encode.ts";
import { GRASP, picture, session } from "../examples.ts";
import { launch, openPage } from "./harness.ts";

test("the page starts without an error", async () => {
  const browser = await launch();
  try {
    const server = await openPage(browser);
    server.send(session(GRASP));
    server.sendPicture(encodePicture(picture(GRASP, 0.1)));
    await server.page.waitForTimeout(300);
    assert.deepEqual(server.errors, []);
  } finally {
    await browser.close();
  }
});
