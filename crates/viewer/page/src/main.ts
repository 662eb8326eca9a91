import "./page.css";
import { connect } from "./connection.ts";
import { createHand } from "./hand/hand.ts";
import { createLesson } from "./lesson/lesson.ts";
import { createPeople } from "./people/people.ts";
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
const send = connect(store);
const view = new View(section("views"));
const plots = new Plots(section("plots"));
createHand(view, store, send);
createPeople(section("header"), section("people"), store, send);
createLesson(section("lesson"), store, send);

let replaying = false;
store.on("session", (session) => {
  if (session.mode === "replay") {
    if (!replaying) createReplay(section("replay"), section("views"), session);
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
