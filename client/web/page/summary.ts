// The figures of palpate-lab summary.
import type { Summary } from "./protocol";

function fill(table: HTMLElement, head: string[], rows: string[][]): void {
  const line = (cells: string[], kind: "th" | "td") => {
    const row = document.createElement("tr");
    for (const text of cells) row.append(Object.assign(document.createElement(kind), { textContent: text }));
    return row;
  };
  table.hidden = rows.length === 0;
  table.replaceChildren(line(head, "th"), ...rows.map((cells) => line(cells, "td")));
}

export function showSummary(summary: Summary, clockText: (s: number) => string): void {
  const element = (id: string) => document.getElementById(id)!;
  fill(
    element("summary-hands"),
    ["hand", "in contact", "contacts", "peak", "mean", `over ${summary.threshold_n} N`, "times", "path", "mean speed", "smoothness"],
    summary.hands.map((hand) => [
      hand.name,
      `${hand.contact_s.toFixed(1)} s`,
      String(hand.contacts),
      `${hand.force_peak_n.toFixed(2)} N`,
      `${hand.force_mean_n.toFixed(2)} N`,
      `${hand.over_s.toFixed(1)} s`,
      String(hand.overs),
      `${hand.path_m.toFixed(2)} m`,
      `${(1e3 * hand.speed_mean_m_s).toFixed(0)} mm/s`,
      hand.smoothness_sparc.toFixed(2),
    ]),
  );
  fill(
    element("summary-attempts"),
    ["hand", "attempt", "from", "score", "time", "done"],
    summary.attempts.map((attempt) => [
      attempt.station,
      String(attempt.attempt),
      clockText(attempt.begin_s),
      `${attempt.score.toFixed(0)} of 100`,
      `${attempt.time_s.toFixed(1)} s`,
      attempt.text,
    ]),
  );
  element("summary-guidance").textContent = summary.guidance
    .map((hold) => `${hold.guide} guided ${hold.guided} from ${clockText(hold.from_s)} on for ${hold.duration_s.toFixed(1)} s.`)
    .join(" ");
  element("summary-source").textContent =
    `Forces of the server's body at its frames, ${Number(summary.force_rate_hz.toPrecision(3))} a second. palpate-lab summary prints the same figures.`;
}
