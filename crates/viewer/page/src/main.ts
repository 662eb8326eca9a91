import "./page.css";
import { connect } from "./connection.ts";
import { createHand } from "./hand/hand.ts";
import { createLesson } from "./lesson/lesson.ts";
import { createHeader } from "./people/header.ts";
import { createNotices } from "./people/notices.ts";
import { createPeople } from "./people/people.ts";
import { createTabs } from "./people/tabs.ts";
import { Plots } from "./plots/plots.ts";
import { createReplay } from "./replay/replay.ts";
import { Store } from "./store.ts";
import { View } from "./view/view.ts";

const section = (id: string): HTMLElement => {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no #${id}`);
  return found;
};

const store = new Store();
// The theme comes with the header: before anything that takes its colours.
createHeader(section("header"), store);
const tabs = createTabs(section("tabs"), [
  { name: "People", panel: section("people") },
  { name: "Lesson", panel: section("lesson") },
]);
tabs.offer(section("lesson"), false);
const send = connect(store);
createNotices({ trouble: section("trouble"), paused: section("paused"), notices: section("notices") }, store, send);
const view = new View(section("views"));
const plots = new Plots(section("plots"));
createHand(view, store, send);
createPeople(section("people"), store, send);
createLesson(section("lesson"), store, send);

let replaying = false;
store.on("session", (session) => {
  tabs.offer(section("lesson"), session.mode === "live" && session.controls.length > 0);
  if (session.mode === "replay") {
    for (const id of ["plots", "panel"]) section(id).hidden = true;
    if (!replaying) {
      view.dispose();
      createReplay(section("replay"), section("views"), session);
    }
    replaying = true;
    return;
  }
  view.introduce(session.about);
  plots.introduce(session.about);
});
store.on("picture", (picture) => {
  view.show(picture);
  plots.add(picture);
});
view.onRate = (hz) => send({ type: "rate", hz });
