// Videos by task, and the figures that lie beside the page.

const BROAD = 1.9;

function videosSection(data) {
  if (!data.videos.length) return null;
  const looks = looksOf(data);
  const tasks = data.tasks.filter(({ task }) => data.videos.some((each) => each.task === task));
  return section(
    "videos",
    "Videos",
    tasks.map((task) => [
      make("h3", {}, taskCell(task)),
      make(
        "div",
        { class: "films" },
        data.videos
          .filter((each) => each.task === task.task)
          .map((each) => film(each, looks.get(each.preset))),
      ),
    ]),
    note("The newest video of each method and selector, from the evaluation's start states."),
  );
}

function film(each, look) {
  const about = make(
    "figcaption",
    {},
    methodCell(look),
    make("span", { class: "detail" }, `seed ${each.seed}, ${each.selector}`),
  );
  const shown = each.data
    ? make("video", {
        src: each.data,
        controls: true,
        muted: true,
        loop: true,
        playsinline: true,
        preload: "metadata",
        "aria-label": `${look.name}, seed ${each.seed}`,
      })
    : make("a", { class: "linked", href: each.link }, "Too large to embed: open the file");
  return make("figure", { class: "card film" }, shown, about);
}

// A picture of several panels gets the whole width.
function spread({ currentTarget: image }) {
  if (image.naturalWidth > BROAD * image.naturalHeight) image.closest("figure").classList.add("broad");
}

function picturesSection(data) {
  if (!data.pictures.length) return null;
  return section(
    "figures",
    "Figures",
    make(
      "div",
      { class: "pictures" },
      data.pictures.map((each) =>
        make(
          "figure",
          { class: "card picture" },
          each.data
            ? make("img", { src: each.data, alt: each.caption.split("\n")[0] || each.name, onload: spread })
            : make("a", { class: "linked", href: each.link }, "Too large to embed: open the file"),
          make("figcaption", {}, make("strong", {}, each.name), " ", each.caption.split("\n")[0]),
        ),
      ),
    ),
  );
}
