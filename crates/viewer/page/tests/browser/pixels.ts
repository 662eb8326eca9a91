// What is on the screen, counted.
import type { Locator, Page } from "playwright-core";

export interface Found {
  count: number;
  /** The middle of what was found, pixels from the picture's left; NaN when there is none. */
  x: number;
  /** The first of them from the left. */
  left: number;
}

/** Pixels of an element as it is on the screen that are nearly of a colour, for each of several. */
export async function findColours(page: Page, element: Locator, colours: [number, number, number][]): Promise<Found[]> {
  const shot = (await element.screenshot()).toString("base64");
  return page.evaluate(async ({ shot, colours }) => {
    const bytes = Uint8Array.from(atob(shot), (letter) => letter.charCodeAt(0));
    const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    if (!context) throw new Error("no canvas to look at pixels with");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    return colours.map((colour) => {
      let [count, x, left] = [0, 0, Infinity];
      for (let i = 0; i < data.length; i += 4) {
        const off = Math.max(...colour.map((part, channel) => Math.abs(part - (data[i + channel] ?? 0))));
        if (off > 60) continue;
        count += 1;
        x += (i / 4) % image.width;
        left = Math.min(left, (i / 4) % image.width);
      }
      return { count, x: x / count, left };
    });
  }, { shot, colours });
}
