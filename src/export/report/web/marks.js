// The shapes of roles, which tell the reds apart without their colours, as those of the figures do.

const MARKS = ["dot", "square", "diamond"];
const OF_ROLES = { leader: "diamond", clamped: "square" };

export function markOf(role) {
  return OF_ROLES[role] ?? "dot";
}

// The mark of each role, by its number in MARKS.
export function marksOf(roleNames) {
  return roleNames.map((name) => MARKS.indexOf(markOf(name)));
}

// Adds a mark to a pen's path that covers about as much as a dot of this radius; by name or by number.
export function traceMark(pen, mark, x, y, radius) {
  const name = MARKS[mark] ?? mark;
  if (name === "square") {
    pen.rect(x - 0.9 * radius, y - 0.9 * radius, 1.8 * radius, 1.8 * radius);
  } else if (name === "diamond") {
    const reach = 1.25 * radius;
    pen.moveTo(x, y - reach);
    pen.lineTo(x + reach, y);
    pen.lineTo(x, y + reach);
    pen.lineTo(x - reach, y);
    pen.closePath();
  } else {
    pen.moveTo(x + radius, y);
    pen.arc(x, y, radius, 0, 2 * Math.PI);
  }
}

// How far a place lies beyond the rim of a mark about the origin; negative within.
export function beyondMark(mark, right, down, radius) {
  if (mark === 1) return Math.max(Math.abs(right), Math.abs(down)) - 0.9 * radius;
  if (mark === 2) return (Math.abs(right) + Math.abs(down) - 1.25 * radius) * Math.SQRT1_2;
  return Math.hypot(right, down) - radius;
}
