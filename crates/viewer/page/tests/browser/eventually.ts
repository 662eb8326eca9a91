// A busy machine draws late: tests wait for what they expect instead of for so long.
import assert from "node:assert/strict";

/** Asks until the answer is as wanted; fails with the last one after ten seconds. */
export async function eventually<T>(ask: () => Promise<T>, isWanted: (answer: T) => boolean): Promise<T> {
  const end_ms = Date.now() + 10_000;
  for (;;) {
    const answer = await ask();
    if (isWanted(answer)) return answer;
    if (Date.now() > end_ms) assert.fail(`it stays ${JSON.stringify(answer)}`);
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
}

export const about = (wanted: number, within: number) => (answer: number) => Math.abs(answer - wanted) <= within;
