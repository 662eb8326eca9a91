// The time that recordings share: zero is where the earliest of them begins.

export interface Span {
  duration_s: number;
  /** When it begins, in the shared time, s. */
  begins_s: number;
}

/** Where recordings begin when each one is moved by its offset: the earliest at zero. */
export function spansOf(durations_s: readonly number[], offsets_s: readonly number[]): Span[] {
  const earliest = Math.min(...durations_s.map((_, index) => offsets_s[index] ?? 0));
  return durations_s.map((duration_s, index) => ({ duration_s, begins_s: (offsets_s[index] ?? 0) - earliest }));
}

/** When the last of them ends. */
export function lengthOf(spans: readonly Span[]): number {
  return Math.max(0, ...spans.map(({ begins_s, duration_s }) => begins_s + duration_s));
}

/** The time within a recording, held at its ends. */
export function within({ begins_s, duration_s }: Span, time_s: number): number {
  return Math.min(duration_s, Math.max(0, time_s - begins_s));
}

/** How far playing comes within `elapsed_s`; a page that slept does not jump. */
export function advanced(time_s: number, elapsed_s: number, speed: number, length_s: number): number {
  return Math.min(length_s, time_s + speed * Math.min(elapsed_s, 0.25));
}

/** `1:02.345`, with hours where there are any. */
export function clock(time_s: number): string {
  const total_ms = Math.round(Math.max(0, time_s) * 1000);
  const seconds = Math.floor(total_ms / 1000);
  const [hours, minutes] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60];
  const rest = `${String(seconds % 60).padStart(2, "0")}.${String(total_ms % 1000).padStart(3, "0")}`;
  return hours > 0 ? `${hours}:${String(minutes).padStart(2, "0")}:${rest}` : `${minutes}:${rest}`;
}
