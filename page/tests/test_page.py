"""The page in a real browser: what it computes there, its controls, its words and its size."""

import dataclasses
import json
import shutil
import statistics

import pytest

from page import PAGE
from page.tests.browser import Chromium, Firefox
from page.tests.conftest import HERE, as_json
from page.tests.test_motion import CASES, compare, random_scene, simulated
from squeal.cli.main import main
from squeal.errors import ComputationError
from squeal.io.scene import read_scene
from squeal.queries.eigenvalues import eigenvalues
from squeal.queries.pads.equilibrium import analyse
from squeal.queries.thresholds import critical_friction
from squeal.simulation.run import simulate
from tests.conftest import ROOT

PROGRAMS = ("chromium", "chromium-browser", "google-chrome", "chrome")
EIGEN = "JSON.stringify(squeal.view.eigen.map(({ re, im }) => [re, im]))"
ADD_ONE = "(s) => { s.value = Number(s.value) + 1; s.dispatchEvent(new Event('input')); }"


@pytest.fixture(scope="module")
def browser(built, tmp_path_factory):
    program = next(filter(None, map(shutil.which, PROGRAMS)), None)
    if program is None:
        pytest.skip("these tests open the page in Chromium, which is not installed")
    opened = Chromium(program, tmp_path_factory.mktemp("profile"))
    yield opened
    opened.close()


@pytest.fixture
def page(browser, built):
    """The page as a reader opens it from disk, in model B2, case (c)."""
    browser.requests.clear()
    browser.complaints.clear()
    browser.address = (built / PAGE).as_uri()
    browser.open(browser.address)
    settled(browser)
    yield browser
    assert browser.complaints == []


def settled(page):
    """Wait until the words and the link are those of the settings."""
    page.wait("squeal.settled")


def text(page, name):
    return page.run(f"document.getElementById('{name}').textContent")


def choose(page, name, option):
    page.run(
        f"(() => {{ const s = document.getElementById('{name}'); s.value = '{option}';"
        "s.dispatchEvent(new Event('change')); })()"
    )


def page_scene(page, folder):
    """The scene whose text the page would copy."""
    file = folder / "scene.yaml"
    file.write_text(value(page, "scene"), encoding="utf-8")
    return read_scene(file)


def value(page, name):
    return page.run(f"document.getElementById('{name}').value")


def test_one_small_file_without_requests(page, built):
    assert (built / PAGE).stat().st_size < 600_000
    assert [r for r in page.requests if r != "about:blank"] == [page.address]


def test_the_eight_cases(page):
    for stem in CASES:
        model, case = stem.split("-")
        for name, choice in (("model", model.upper()), ("case", case)):
            page.run(f"document.querySelector('[name={name}][value={choice}]').click()")
        settled(page)
        scene = read_scene(ROOT / "workflow" / "scenes" / f"{stem}.yaml")
        answer = json.loads(page.run("JSON.stringify(squeal.motion(squeal.settings))"))
        assert compare(scene, answer, simulate(scene)) < 1e-10, stem
        assert page.run("squeal.view.motion.steps") == answer["steps"]
        assert text(page, "n_contacts").startswith(f"{len(answer['changes'])};")


def test_random_pads(page):
    scenes = [as_json(random_scene(seed)) for seed in range(270)]
    answers = json.loads(
        page.run(f"JSON.stringify({json.dumps(scenes)}.map((s) => squeal.motion(s)))")
    )
    whole = [i for i, answer in enumerate(answers) if not (answer["end"] or answer["refusal"])]
    assert len(whole) >= 200
    for seed in whole:
        assert compare(random_scene(seed), answers[seed], simulated(seed)) < 1e-10, seed


def test_keys_move_a_slider_and_all_follows(page):
    page.run("document.getElementById('mu').focus()")
    before = float(value(page, "mu_number"))
    contacts = text(page, "n_contacts")
    page.press("ArrowRight", 25)
    settled(page)
    after = float(value(page, "mu_number"))
    assert after == pytest.approx(before + 25 * 1.5 / 1000, abs=0.001)
    assert page.run("squeal.view.body.pad.mu") == after
    assert text(page, "n_contacts") != contacts
    assert f"mu={after}" in page.run("location.hash")
    assert page.run("document.getElementById('mu').getAttribute('aria-valuetext')").strip() == str(
        after
    )


def test_a_refused_number_is_named_and_changes_nothing(page):
    page.run(
        "(() => { const f = document.getElementById('k1_number'); f.value = '-3';"
        "f.dispatchEvent(new Event('change')); })()"
    )
    assert "at least 0 MN/m" in text(page, "k1_refusal")
    page.run(
        "(() => { const f = document.getElementById('stop_number'); f.value = '200';"
        "f.dispatchEvent(new Event('change')); })()"
    )
    assert "below 100 ms" in text(page, "stop_refusal")
    assert page.run("document.getElementById('k1_number').getAttribute('aria-invalid')") == "true"
    assert page.run("squeal.settings.parameters.k1") == 150e6


@pytest.mark.parametrize(("model", "stiffness"), [("B1", "k3"), ("BN", "k_c")])
def test_a_link_carries_the_settings(page, model, stiffness):
    page.run(f"document.querySelector('[name=model][value={model}]').click()")
    for name in ("alpha1", stiffness, "start_4", "stop", "damping"):
        page.run(f"({ADD_ONE})(document.getElementById('{name}'))")
    if model == "BN":
        choose(page, "springs", "8")
    settled(page)
    settings = page.run("JSON.stringify(squeal.settings)")
    link = page.run("location.href")
    page.open(link)
    settled(page)
    assert json.loads(page.run("JSON.stringify(squeal.settings)")) == json.loads(settings)
    assert page.run("squeal.settings.damping") == 0.0001
    wrong = "mu=-1&line_force=odd&stop=nothing&damping=-0.1"
    page.run(f"location.hash = '#model=B2&case=a&{wrong}'")
    page.wait("squeal.settings.case === 'a'")
    settled(page)
    case = read_scene(ROOT / "workflow" / "scenes" / "b2-a.yaml")
    assert page.run("squeal.settings.parameters.mu") == case.pad.mu  # refused, not taken
    assert page.run("squeal.settings.stop") == case.stop
    assert page.run("squeal.settings.damping") == 0.0


@pytest.mark.parametrize("model", ["B1", "B2", "BN"])
def test_the_scene_file_is_simulated_to_the_same_end(page, tmp_path, capsys, model):
    page.run(f"document.querySelector('[name=model][value={model}]').click()")
    if model == "B2":
        choose(page, "line_force", "integral")
    if model == "BN":
        choose(page, "springs", "4")
    for name in ("mu", "start_1", "start_0", "theta0", "k2", "V", "damping"):
        page.run(f"({ADD_ONE})(document.getElementById('{name}'))")
    page.run(
        "(() => { const f = document.getElementById('start_3_number'); f.value = '1e-7';"
        "f.dispatchEvent(new Event('change')); })()"
    )
    settled(page)
    read = page_scene(page, tmp_path)
    assert main(["simulate", "--json", str(read.source)]) == 0
    final = json.loads(capsys.readouterr().out)["final"]
    assert read.damping.ratios == (0.0001,) * 3
    answer = json.loads(page.run("JSON.stringify(squeal.motion(squeal.settings))"))
    names = ("x", "y", "theta", "x_dot", "y_dot", "theta_dot")
    assert compare(read, answer, simulate(read)) < 1e-10
    assert answer["state"] == pytest.approx([final[n] for n in names], rel=1e-7)


def test_damping_counts_in_motion_eigenvalues_and_threshold(page, tmp_path):
    free = json.loads(page.run("JSON.stringify(squeal.view.eigen)"))
    first = text(page, "n_final")
    assert page.run("squeal.view.body.damped") is False
    page.run(f"for (let i = 0; i < 50; i++) ({ADD_ONE})(document.getElementById('damping'))")
    settled(page)
    assert text(page, "n_damping") == "0.5 % of critical in each mode without friction"
    assert text(page, "n_final") != first
    scene = page_scene(page, tmp_path)
    roots = [complex(*part) for part in json.loads(page.run(EIGEN))]
    analysis = analyse(scene)
    assert roots == pytest.approx(list(analysis.spectrum.values[::2]), rel=1e-9)
    assert text(page, "n_verdict") == analysis.judgement.verdict
    assert max(r.real for r in roots) < max(e["re"] for e in free)
    (given,) = json.loads(page.run("JSON.stringify(squeal.view.thresholds)"))[:1]
    expected = critical_friction(scene).points[0]
    assert (given["kind"], given["mu"]) == (expected.kind, pytest.approx(expected.mu, rel=1e-6))


def test_damping_that_has_no_mode_to_refer_to_is_refused(page, tmp_path):
    choose(page, "delta_moment", "-")
    page.run(f"({ADD_ONE})(document.getElementById('damping'))")
    settled(page)
    assert text(page, "n_damping").startswith("none: ")
    assert "Undamped: " in text(page, "status")
    with pytest.raises(ComputationError):
        analyse(page_scene(page, tmp_path))


def test_a_click_on_the_map_moves_the_pad_there(page):
    page.run(
        "(() => { const m = document.getElementById('map'); const r = m.getBoundingClientRect();"
        "m.dispatchEvent(new MouseEvent('click', { clientX: r.left + 150, clientY: r.top + 150 }));"
        " })()"
    )
    settled(page)
    assert float(value(page, "alpha1_number")) != 0.75
    assert f"α₁ = {float(value(page, 'alpha1_number')):.3f} π" in text(page, "n_map")


def test_everything_has_a_name_for_a_screen_reader(page):
    page.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    nodes = page.ask("Accessibility.getFullAXTree")["nodes"]
    roles = ("slider", "spinbutton", "combobox", "button", "radio", "image", "img", "textbox")
    named = [n for n in nodes if not n["ignored"] and n["role"]["value"] in roles]
    assert len(named) > 40
    assert [n for n in named if not n.get("name", {}).get("value", "").strip()] == []
    pictures = [n["name"]["value"] for n in named if n["role"]["value"] in ("image", "img")]
    changes = simulate(read_scene(ROOT / "workflow" / "scenes" / "b2-c.yaml")).contact_changes
    assert any(f"Share of time: {changes};" in words for words in pictures)
    assert f"{changes} contact changes" in text(page, "status")


def test_tab_reaches_the_controls_in_order_and_shows_where_it_is(page):
    order = []
    page.run("document.querySelector('[name=model]:checked').focus()")
    for _ in range(6):
        page.press("Tab")
        order.append(page.run("document.activeElement.id || document.activeElement.name"))
    assert order == ["case", "reset", "mu_number", "mu", "damping_number", "damping"]
    assert page.run("getComputedStyle(document.activeElement).outlineStyle") == "solid"


FOCUSED = """(() => {
  const a = document.activeElement, r = a.getBoundingClientRect();
  const y = (r.top + r.bottom) / 2, x = (r.left + r.right) / 2;
  if (a === document.body) return [null, true];
  const above = document.elementFromPoint(x, y);
  const seen = above !== null && (a.contains(above) || above.contains(a));
  return [a.id || a.name || a.textContent, seen];
})()"""


@pytest.mark.parametrize(("width", "height"), [(1440, 900), (720, 450), (390, 844), (360, 640)])
def test_what_has_the_focus_is_never_hidden(page, width, height):
    page.open(page.address, width=width, height=height)
    settled(page)
    page.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    stops = 0
    hidden = []
    for _ in range(90):
        page.press("Tab")
        name, seen = page.run(FOCUSED)
        if name is None and stops:
            break
        stops += 1
        if not seen:
            hidden.append(name)
    assert stops > 45
    assert hidden == []


def preset(page, title):
    """Press the button of an example."""
    page.run(
        "[...document.querySelectorAll('#presets button')]"
        f".find((b) => b.textContent.startsWith('{title}')).click()"
    )
    page.wait("!squeal.settled")
    settled(page)


def test_each_example_shows_what_it_says(page, tmp_path):
    verdicts = {}
    late = {}
    titles = ("The article", "Just below", "Damping saves", "A cycle beside")
    for title in titles:
        preset(page, title)
        scene = page_scene(page, tmp_path)
        words = text(page, "conclusion").replace("µ", "mu").replace("−", "-")
        assert words == eigenvalues(scene).conclusion
        verdicts[title] = analyse(scene).judgement.verdict
        events = simulate(scene).events
        late[title] = bool(events) and events[-1].t > 0.9 * scene.stop
    assert list(verdicts.values()) == ["flutter", "marginal", "stable", "stable"]
    assert late == {t: t in ("The article", "A cycle beside") for t in titles}
    knocked = scene.replace(mu=scene.pad.mu)
    gentle = dataclasses.replace(knocked, initial=(*scene.initial[:4], 0.5, 0.0))
    assert simulate(gentle).events[-1].t < 0.5 * scene.stop  # the other half of the last one


def test_a_run_cut_at_its_limit_says_so_first(page):
    assert text(page, "warnings") == ""
    page.run("location.hash = '#model=B2&case=c&k1=15e12&k_c=9e12&stop=0.09'")
    page.wait("squeal.settings.stop === 0.09")
    settled(page)
    assert page.run("squeal.view.motion.end") is not None
    assert "Cut at" in text(page, "warnings")
    right = "squeal.read('histories', document.getElementById('histories').clientWidth - 20)"
    assert page.run(right).endswith("not computed")


def test_map_cells_that_are_not_yet_computed_look_unlike_all_verdicts(page):
    for scheme in ("light", "dark"):
        page.ask(
            "Emulation.setEmulatedMedia",
            features=[{"name": "prefers-color-scheme", "value": scheme}],
        )
        fills = page.run("squeal.paint.verdicts")
        assert fills.count(fills[-1]) == 1
    page.ask("Emulation.setEmulatedMedia", features=[])


def test_only_the_line_contact_has_b3(page):
    assert "B3" in text(page, "origin_name")
    page.run("document.querySelector('[name=model][value=B1]').click()")
    settled(page)
    assert "B3" not in text(page, "origin_name")


AXE = HERE.parent / "node_modules" / "axe-core" / "axe.min.js"
VIOLATIONS = """window.axe.run().then(({ violations }) => violations.map(({ id, nodes }) => {
  return `${id}: ${nodes.map((n) => n.target).join(", ")}`;
}))"""


@pytest.mark.skipif(not AXE.exists(), reason="axe-core is not installed: npm ci --prefix page")
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [390, 1440])
def test_axe_finds_nothing(page, scheme, width):
    features = [{"name": "prefers-color-scheme", "value": scheme}]
    page.ask("Emulation.setEmulatedMedia", features=features)
    page.open(page.address, width=width)
    settled(page)
    page.run("document.querySelectorAll('details').forEach((d) => { d.open = true; })")
    page.run(f"(() => {{ {AXE.read_text(encoding='utf-8')} }})()")
    found = page.run(VIOLATIONS)
    page.ask("Emulation.setEmulatedMedia", features=[])
    assert found == []


def test_print_is_on_white(page):
    dark = [{"name": "prefers-color-scheme", "value": "dark"}]
    page.ask("Emulation.setEmulatedMedia", features=dark)
    page.wait("squeal.paint.panel !== '#fff'")
    page.run("dispatchEvent(new Event('beforeprint'))")
    assert page.run("squeal.paint.panel") == "#fff"
    page.run("dispatchEvent(new Event('afterprint'))")
    assert page.run("squeal.paint.panel") != "#fff"
    page.ask("Emulation.setEmulatedMedia", features=[])


@pytest.fixture(scope="module")
def firefox(built, tmp_path_factory):
    program = next(filter(None, map(shutil.which, ("firefox", "firefox-esr"))), None)
    if program is None:
        pytest.skip("this test opens the page in Firefox, which is not installed")
    opened = Firefox(program, tmp_path_factory.mktemp("firefox"))
    yield opened
    opened.close()


def test_firefox_computes_the_same(firefox, built):
    firefox.open((built / PAGE).as_uri())
    firefox.wait("squeal.settled")
    for stem in ("b1-c", "b2-c"):
        scene = read_scene(ROOT / "workflow" / "scenes" / f"{stem}.yaml")
        asked = f"JSON.stringify(squeal.motion({json.dumps(as_json(scene))}))"
        assert compare(scene, json.loads(firefox.run(asked)), simulate(scene)) < 1e-10
    words = firefox.run("document.getElementById('conclusion').textContent")
    assert words.replace("µ", "mu").replace("−", "-") == eigenvalues(scene).conclusion
    assert firefox.run("document.scrollingElement.scrollWidth <= innerWidth")
    if AXE.exists():
        axe = AXE.read_text(encoding="utf-8")
        assert firefox.run(f"(() => {{ {axe}; return {VIOLATIONS}; }})()") == []


def test_reduced_motion_is_respected(page):
    assert text(page, "play") == "Pause"
    feature = {"name": "prefers-reduced-motion", "value": "reduce"}
    page.ask("Emulation.setEmulatedMedia", features=[feature])
    page.open(page.address)
    settled(page)
    before = value(page, "time")
    page.run("new Promise((go) => setTimeout(go, 500))")
    page.ask("Emulation.setEmulatedMedia", features=[])
    assert text(page, "play") == "Play"
    assert value(page, "time") == before == "0"


def test_hearing_starts_and_stops(page):
    page.run("document.getElementById('slow').value = '16'")
    page.run("document.getElementById('hear').click()")
    page.wait("document.getElementById('status').textContent.startsWith('Playing 1.00 s')")
    page.run("document.getElementById('hear').click()")
    page.wait("document.getElementById('hear').textContent === 'Hear'")


@pytest.mark.parametrize("width", [360, 800, 1400])
def test_nothing_is_wider_than_the_window(page, width, tmp_path):
    page.open(page.address, width=width)
    settled(page)
    assert page.run("document.scrollingElement.scrollWidth") <= width
    page.picture(tmp_path / "page.png")
    assert (tmp_path / "page.png").stat().st_size > 50_000


def test_redraws(page, capsys):
    move = (
        "(async () => { const costs = [], s = document.getElementById('mu');"
        "for (let i = 0; i < 30; i++) { const last = squeal.view;"
        f"({ADD_ONE})(s);"
        "while (squeal.view === last) await new Promise(requestAnimationFrame);"
        "costs.push(squeal.view.cost.compute + squeal.view.cost.draw); } return costs; })()"
    )
    page.run(move)  # the browser compiles what runs often
    costs = sorted(page.run(move))
    assert len(costs) == 30
    with capsys.disabled():
        print(
            f"\nredraw: median {statistics.median(costs):.1f} ms, 9 of 10 below {costs[26]:.1f} ms"
        )
