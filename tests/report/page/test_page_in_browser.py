"""The page in headless Chromium: opened, sorted, toggled and read, at a desktop's and at a phone's width."""

import struct
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from playwright.sync_api import expect, sync_playwright

SCRIPT = Path(__file__).parents[3] / "scripts/photograph_page.py"
MAIN, OVERALL, NUMBERS = (f"#results .table >> nth={place}" for place in range(3))


@pytest.fixture(scope="module")
def browser(photography):
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=photography["chromium"](playwright))
        yield browser
        browser.close()


@pytest.fixture
def look(browser, photography, page):
    """Opens the page in one of the views; at the end it must not have complained or asked for anything."""
    complaints, tabs = [], []

    def opened(name):
        view = next(view for view in photography["VIEWS"] if view.name == name)
        tabs.append(photography["opened"](browser, page, view, complaints))
        return tabs[-1]

    yield opened
    for tab in tabs:
        tab.close()
    assert complaints == []


@pytest.fixture
def desktop(look):
    return look("desktop")


def rows(tab, table):
    """The cells' texts of every row, each in one line."""
    found = tab.locator(f"{table} >> tbody > tr").all()
    return [[" ".join(cell.split()) for cell in row.locator("th, td").all_inner_texts()] for row in found]


def sort(tab, table, name):
    tab.locator(f"{table} >> thead").get_by_role("button", name=name).click()


def test_it_opens_with_its_protocol_and_its_numbers(desktop):
    assert desktop.title() == "3 methods on 2 tasks"
    assert desktop.locator("h1").inner_text() == "3 methods on 2 tasks"
    facts = desktop.locator("#protocol").inner_text().split()
    assert " ".join(facts) == "budget cpu steps 500 adapter paper evaluation episodes 10 seeds 0 1"
    drawer, reach = rows(desktop, MAIN)
    assert drawer[:3] == ["DrawerOpen metaworld", "50.0 ± 70.7", "60.0 ± 0.0"]
    assert reach == ["Reach point", "–", "90.0 ± 0.0", "–"]
    foot = desktop.locator(f"{MAIN} >> tfoot").inner_text().split()
    assert " ".join(foot) == "Across tasks – 75.0 ± 21.2 –"
    assert desktop.locator(f"{MAIN} >> .best").all_inner_texts() == ["60.0 ± 0.0"]


def test_text_from_the_runs_stays_text(desktop):
    assert desktop.get_by_text("<img src=x onerror=alert(1)>").count() > 3
    assert desktop.locator("img").count() == 0


def test_tables_are_sorted_by_a_click_on_their_headings_and_by_keyboard(desktop):
    def first():
        return [row[0].split()[0] for row in rows(desktop, MAIN)]

    head = desktop.locator(f"{MAIN} >> th", has_text="HCPG-Flow")
    assert first() == ["DrawerOpen", "Reach"]
    sort(desktop, MAIN, "HCPG-Flow")
    assert (first(), head.get_attribute("aria-sort")) == (["Reach", "DrawerOpen"], "descending")
    desktop.keyboard.press("Enter")
    assert (first(), head.get_attribute("aria-sort")) == (["DrawerOpen", "Reach"], "ascending")
    for _ in ("falling", "rising"):  # Reach has no SAC-Flow: it comes last either way
        sort(desktop, MAIN, "SAC-Flow")
        assert first() == ["DrawerOpen", "Reach"]
    assert head.get_attribute("aria-sort") == "none"


def test_numbers_are_sorted_as_numbers(desktop):
    sort(desktop, NUMBERS, "Last evaluation")
    means = [float(row[4].split()[0]) for row in rows(desktop, NUMBERS)]
    assert means == [100.0, 90.0, 50.0, 50.0, 40.0, 30.0]
    assert rows(desktop, NUMBERS)[0][5] == "20/20 [83.9, 100.0]"


def test_the_metric_and_the_policy_are_switched(desktop):
    desktop.get_by_role("button", name="Last evaluation").first.click()
    assert rows(desktop, MAIN)[0][2] == "100.0 ± 0.0"
    policy = desktop.locator("#results").get_by_role("button", name="Bare actor")
    policy.click()
    assert rows(desktop, MAIN)[0][2] == "50.0 ± 0.0"
    assert policy.get_attribute("aria-pressed") == "true"


def test_methods_are_switched_off_and_on_in_every_panel(desktop):
    curves = desktop.locator("#curves .curve[data-preset=hcpg_flow]")
    chip = desktop.locator("#curves .legend").get_by_role("button", name="HCPG-Flow")
    assert curves.count() == 2
    chip.click()
    assert (curves.count(), chip.get_attribute("aria-pressed")) == (0, "false")
    assert desktop.locator("#curves .curve").count() == 2
    chip.click()
    assert curves.count() == 2
    desktop.locator("#curves").get_by_role("button", name="Both").click()
    assert desktop.locator("#curves .curve.dashed").count() == 2
    assert desktop.locator("#curves .band").count() == 6
    desktop.locator("#curves").get_by_role("button", name="None").click()
    assert desktop.locator("#curves .band").count() == 0


def test_curves_are_read_under_the_pointer_and_by_the_arrow_keys(desktop):
    stage = desktop.locator("#curves .stage").first
    stage.scroll_into_view_if_needed()
    box = stage.bounding_box()
    readout = stage.locator(".readout")
    desktop.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 60)
    expect(readout).to_be_visible()
    assert readout.inner_text().split()[:5] == ["300", "steps", "HCPG-Flow", "60.0", "±"]
    assert "SAC-Flow 50.0 ± 70.7" in " ".join(readout.inner_text().split())
    desktop.mouse.move(0, 0)
    expect(readout).to_be_hidden()
    stage.focus()
    desktop.keyboard.press("End")
    assert readout.locator("strong").inner_text() == "500 steps"
    desktop.keyboard.press("ArrowLeft")
    assert readout.locator("strong").inner_text() == "400 steps"
    assert stage.locator("[aria-live]").inner_text().startswith("400 steps: HCPG-Flow 80.0 percent")
    desktop.keyboard.press("Escape")
    expect(readout).to_be_hidden()


def test_differences_say_what_may_be_said(desktop):
    (sac_flow, odd) = rows(desktop, "#differences .table")
    assert sac_flow[2] == "−50.0"
    # Newcombe: -0.5 - (0.5 - 0.299) and -0.5 + sqrt((0.701 - 0.5)² + (1 - 0.839)²), from Wilson's bounds.
    assert " ".join(sac_flow[4].split()) == "paired −100.0 to 0.0 Newcombe −70.1 to −24.3"
    assert (sac_flow[5], odd[5]) == ("undecided", "worse")
    assert sac_flow[6].startswith("Undecided: the interval includes zero; 2 seeds say little")


def test_the_video_plays_from_the_file_itself(desktop):
    film = desktop.locator("#videos video")
    assert film.count() == 1
    loaded = "new Promise(done => { film.onloadedmetadata = () => done(film.videoWidth); film.load(); })"
    width = film.evaluate(f"film => {loaded}")
    assert width == 48
    assert "seed 1, hcpg" in desktop.locator("#videos figcaption").inner_text()


def test_the_manifest_lists_the_runs_when_it_is_opened(desktop):
    runs = desktop.locator("#manifest details", has_text="8 runs")
    assert runs.locator("tbody tr").count() == 0
    runs.locator("summary").click()
    # The browser tells of the opening only after the click has returned.
    expect(runs.locator("tbody tr")).to_have_count(8)
    runs.get_by_role("searchbox").fill("reach")
    expect(runs.locator("tbody tr")).to_have_count(2)
    assert "point/reach/hcpg_flow/s1/a" in runs.inner_text()


def test_the_theme_is_chosen_by_the_reader(desktop):
    def ground():
        return desktop.evaluate("getComputedStyle(document.body).backgroundColor")

    assert ground() == "rgb(245, 246, 248)"
    for scheme in ("light", "dark"):
        desktop.get_by_role("button", name="Theme").click()
        assert desktop.locator("html").get_attribute("data-theme") == scheme
    assert ground() == "rgb(17, 19, 23)"


def test_on_a_phone_tables_scroll_and_the_page_does_not(look):
    phone = look("phone")
    phone.locator("#manifest summary").last.click()
    assert phone.evaluate("document.documentElement.scrollWidth") == 375
    wide = "all => all.filter(each => each.scrollWidth > each.clientWidth).length"
    assert phone.locator(".scroll").evaluate_all(wide) >= 4
    widths = "all => all.map(each => each.getBoundingClientRect().width)"
    assert phone.locator("#curves .panel").evaluate_all(widths) == [347, 347]
    phone.locator("#curves .stage").first.click()
    assert phone.locator("#curves .readout:visible").count() == 1
    assert phone.evaluate("document.documentElement.scrollWidth") == 375


def test_without_javascript_the_table_is_there(browser, page):
    tab = browser.new_context(java_script_enabled=False).new_page()
    tab.goto(page.as_uri())
    assert "| DrawerOpen" in tab.locator("noscript pre").inner_text()
    tab.close()


def test_the_script_photographs_a_view(page, tmp_path):
    subprocess.run([sys.executable, str(SCRIPT), str(page), str(tmp_path), "--views", "phone"], check=True)
    (picture,) = tmp_path.iterdir()
    width, height = struct.unpack(">II", picture.read_bytes()[16:24])
    assert (picture.name, width) == ("phone.png", 375)
    assert height > 2000


def test_no_browser_is_an_error_that_names_the_package(photography, monkeypatch):
    monkeypatch.setenv("PATH", "")
    playwright = SimpleNamespace(chromium=SimpleNamespace(executable_path="/nowhere/chrome"))
    with pytest.raises(SystemExit, match=r"and for /nowhere/chrome.*install_system_packages\.sh browser"):
        photography["chromium"](playwright)
