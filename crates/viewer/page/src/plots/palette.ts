// The page's colours, for canvases: they cannot use CSS variables themselves.

const FALLBACKS = ["#2563eb", "#d97706", "#059669", "#db2777", "#7c3aed", "#0891b2", "#65a30d", "#dc2626"];

/** What the CSS variable says right now; it changes with the theme. */
export function colour(variable: string, fallback: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(variable).trim() || fallback;
}

/** Of a user; null is for what belongs to nobody. */
export function userColour(user: number | null): string {
  if (user === null) return colour("--text", "#222222");
  const index = user % FALLBACKS.length;
  return colour(`--user-${index}`, FALLBACKS[index] ?? "#2563eb");
}
