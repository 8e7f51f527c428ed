// Put the sections together.

const DATA = JSON.parse(document.getElementById("data").textContent);
const FEW = 3;
const THEMES = ["system", "light", "dark"];

function noticesSection(data) {
  if (!data.notices.length) return null;
  return section(
    "notices",
    counted(data.notices.length, "notice", "notices"),
    noticeList(data.notices.slice(0, FEW)),
    data.notices.length > FEW ? folded("Show the others", () => noticeList(data.notices.slice(FEW))) : null,
  );
}

const noticeList = (notices) =>
  make(
    "ul",
    { class: "card notices" },
    notices.map((each) => make("li", {}, each)),
  );

function themeSwitch(button) {
  let place = 0;
  button.addEventListener("click", () => {
    place = (place + 1) % THEMES.length;
    document.documentElement.dataset.theme = THEMES[place];
    button.textContent = `Theme: ${THEMES[place]}`;
  });
}

document.getElementById("title").textContent = DATA.title;
document
  .getElementById("protocol")
  .append(
    ...Object.entries(DATA.protocol).map(([name, value]) =>
      make("div", {}, make("dt", {}, name), make("dd", {}, value)),
    ),
  );
const SECTIONS = [
  noticesSection,
  resultsSection,
  curvesSection,
  contrastsSection,
  settingsSection,
  videosSection,
  picturesSection,
  manifestSection,
]
  .map((build) => build(DATA))
  .filter(Boolean);
document.getElementById("main").append(...SECTIONS);
document.getElementById("contents").append(
  make(
    "ul",
    { class: "wide" },
    SECTIONS.map((each) =>
      make("li", {}, make("a", { href: `#${each.id}` }, each.id[0].toUpperCase() + each.id.slice(1))),
    ),
  ),
);
document
  .getElementById("made")
  .append(`Made by hcpg ${DATA.made.version} (${DATA.made.commit}): `, make("code", {}, DATA.made.command));
themeSwitch(document.getElementById("theme"));
