// Notes: what somebody wrote about a moment.
import type { Note } from "./protocol";

const SIGNS = { waiting: "\u2026", recorded: "\u25be", refused: "\u2717" }; // as the sign on the bar of the time

export class NoteList {
  all: Note[] = [];
  private shown = "";

  /** `seek`: shows a moment of a recording. */
  constructor(
    private readonly box: HTMLElement,
    private readonly seek: (t: number) => void,
  ) {}

  get empty(): boolean {
    return this.all.length === 0;
  }

  set(all: Note[]): void {
    this.all = all;
    this.shown = "";
  }

  /** The moment of the note after t (by 1), or before it (by -1). */
  beside(t: number, by: 1 | -1): number | null {
    const step = 0.02; // a moment that was sought may be a frame off
    const times = this.all.map((note) => note.t).filter((at) => (by > 0 ? at > t + step : at < t - step));
    return times.length === 0 ? null : by > 0 ? Math.min(...times) : Math.max(...times);
  }

  /** `at`: the moment of a recording that is shown; null: the notes are about what happens now, the newest first. */
  show(at: number | null, timeText: (t: number) => string): void {
    const current = at === null ? -1 : this.all.filter((note) => note.t <= at + 0.02).length - 1;
    const key = `${at !== null} ${current}`;
    if (this.shown === key) return;
    this.shown = key;
    const items = this.all.map((note, i) => this.item(note, i === current, at !== null, timeText(note.t)));
    this.box.replaceChildren(...(at === null ? items.reverse() : items));
    this.box.querySelector("[aria-current]")?.scrollIntoView({ block: "nearest" });
  }

  private item(note: Note, current: boolean, played: boolean, time: string): HTMLElement {
    const item = document.createElement("li");
    item.dataset.state = note.state;
    const line = document.createElement(played ? "button" : "div");
    if (played) {
      (line as HTMLButtonElement).type = "button";
      line.addEventListener("click", () => this.seek(note.t));
    }
    if (current) line.setAttribute("aria-current", "true");
    const when = document.createElement("span");
    when.className = "when";
    when.textContent = `${SIGNS[note.state]} ${time}`;
    const who = document.createElement("b");
    who.textContent = note.author;
    const words = document.createElement("span");
    words.className = "words";
    words.textContent = note.text || (note.state === "refused" ? "" : "(mark)");
    line.append(when, who, words);
    if (note.state !== "recorded") {
      const state = document.createElement("span");
      state.className = "why";
      state.textContent = note.state === "waiting" ? "not recorded yet" : `not recorded: ${note.why ?? ""}`;
      line.append(state);
    }
    item.append(line);
    return item;
  }
}
