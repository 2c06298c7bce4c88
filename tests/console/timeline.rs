//! The film's bar: names of its lanes, how much of it is shown, and that a press chooses while Seek alone goes.

use serde_json::json;

use crate::browser::Browser;
use crate::hall::Hall;
use crate::{arm, enter, go};

/// The names that the bar has drawn since the page was told to listen.
const LISTEN: &str = "
    const draw = CanvasRenderingContext2D.prototype.fillText;
    window.drawn = new Set();
    CanvasRenderingContext2D.prototype.fillText = function (text, ...more) {
      if (this.canvas.id === 'lanes') window.drawn.add(text);
      return draw.call(this, text, ...more);
    };";

/// From when to when the film is shown, s.
fn shown(browser: &Browser) -> [f64; 2] {
    let ends = browser
        .eval("const bar = document.getElementById('seek'); return [Number(bar.min), Number(bar.max)]");
    [0, 1].map(|end: usize| (ends[end].as_f64().expect("a number") * 10.0).round() / 10.0)
}

/// Turns the wheel over the bar, that part of its width from the left.
fn wheel(browser: &Browser, towards: i32, part: f64) {
    browser.eval(&format!(
        "const bar = document.getElementById('seek'), {{ left, top, width }} = document.getElementById('lanes').getBoundingClientRect();
         bar.dispatchEvent(new WheelEvent('wheel', {{ deltaY: {towards}, clientX: left + width * {part}, clientY: top + 9, cancelable: true }}))"
    ));
}

#[test]
fn lanes_have_names_wheel_and_keys_show_less_of_the_film_and_only_seek_moves_the_seats() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    browser.eval(LISTEN);
    arm(&browser);
    browser.wait("['a1', 'a2', 'a3'].every((name) => window.drawn.has(name))");
    browser.wait("document.querySelectorAll('#margins button').length === 5");
    browser.reads("margins", "velocity");
    browser.reads("margins", "%");
    go(&browser);
    assert_eq!(shown(&browser), [0.0, 120.0]);
    wheel(&browser, -1, 0.5);
    let [from, to] = shown(&browser);
    assert!(
        (to - from - 96.0).abs() < 0.2 && ((from + to) / 2.0 - 60.0).abs() < 0.2,
        "about the pointer: {from} to {to}"
    );
    browser.wait("!document.getElementById('zoomed').hidden");
    browser.reads("zoomed-words", "00:12");
    browser.eval("document.getElementById('seek').focus()");
    for _ in 0..5 {
        browser.type_text("+");
    }
    let [from, to] = shown(&browser);
    assert!((to - from - 10.0).abs() < 0.2, "no nearer than ten seconds: {from} to {to}");
    browser.shot("92-timeline");

    // Choosing moves nothing, wherever it is done; the film plays on until somebody seeks.
    browser.press("#seek"); // in its middle
    browser.wait("!document.getElementById('seek-ask').hidden");
    let chosen =
        browser.eval("return Number(document.getElementById('seek').value)").as_f64().expect("a number");
    assert!((from..=to).contains(&chosen), "{chosen} is in {from} to {to}");
    browser.press("#margins button");
    browser.reads("seek-go", "seek ");
    browser.press("#seek-leave");
    browser.wait("/^00:[0-3]/.test(document.getElementById('position').textContent)");
    assert_eq!(browser.eval("return document.getElementById('state').textContent"), json!("playing"));
    browser.press("#whole");
    browser.wait("document.getElementById('zoomed').hidden");
    assert_eq!(shown(&browser), [0.0, 120.0]);
    wheel(&browser, 1, 0.5); // there is no more to show
    assert_eq!(shown(&browser), [0.0, 120.0]);
    assert_eq!(browser.complaints(), Vec::<String>::new());
}

#[test]
fn no_name_of_an_effect_is_covered_by_the_next_one_and_one_without_room_is_left_out() {
    let Some(browser) = Browser::start() else { return };
    let hall = Hall::open();
    enter(&browser, &hall);
    // Two effects that take turns all through a cue, and one near its end that stands alone.
    let drawn = browser.eval(
        "const pen = CanvasRenderingContext2D.prototype, { fillText, fillRect } = pen, texts = [], blocks = [];
         pen.fillText = function (text, x, y) { texts.push([text, x, x + this.measureText(text).width, y]); };
         pen.fillRect = function (x, y, width, height) { blocks.push([x, x + width, y, y + height]); };
         const on = (is) => Array.from({ length: 200 }, (_, at) => is(at));
         const turns = (from) => on((at) => at < 160 && (at + from) % 12 < 3);
         const effects = ['light', 'smoke', 'air', 'wind'].map((name, from) => ({ name, on: turns(3 * from) }));
         return import('/js/timeline.js').then(({ setCue }) => {
           setCue({ axes: [{ name: 'a1', colour: '#fff', min: on(() => 0), max: on(() => 0) }],
             effects: [...effects, { name: 'alone', on: on((at) => at === 170) }], markers: [], length: 200 });
           Object.assign(pen, { fillText, fillRect });
           const covered = texts.slice(1).filter(([, from, to, y]) => blocks.some(([left, right, top, bottom]) => left > from && left < to && top < y && y < bottom));
           return [texts.some(([text]) => text === 'alone'), covered.map(([text]) => text)];
         });",
    );
    assert_eq!(drawn, json!([true, []]));
}
