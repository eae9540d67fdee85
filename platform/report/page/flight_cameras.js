// The newest image of each camera at a moment. A pixel is one letter: '@' is the nearest of kLevels distances, spaced evenly in their
// logarithm from kNearest_m to the camera's range, ' ' is nothing within range, '!' no value.

const kLevels = 32, kNearest_m = 0.3;

class Cameras {
  constructor(images) {
    this.of = [];
    for (const image of images) (this.of[image.camera] ??= { name: image.name, images: [], times: [] }).images.push(image);
    $('seen').hidden = images.length === 0;
    this.of.forEach((camera, i) => {
      camera.times = camera.images.map(image => image.time_s);
      const figure = document.createElement('figure');
      camera.canvas = document.createElement('canvas');
      camera.canvas.setAttribute('role', 'img');
      camera.canvas.setAttribute('aria-label', `What camera ${camera.name || i + 1} saw`);
      camera.caption = document.createElement('figcaption');
      figure.append(camera.canvas, camera.caption);
      $('cameras').append(figure);
    });
  }
  draw(t, theme) {
    this.of.forEach((camera, i) => {
      const at = index_at(camera.times, t + 1e-6), image = camera.images[at];
      camera.caption.textContent = `${camera.name || i + 1}: ${image ? `${(t - image.time_s).toFixed(1)} s ago` : 'nothing yet'}`;
      if (image !== camera.shown || theme !== this.theme) this.paint(camera.canvas, image, theme);
      camera.shown = image;
    });
    if (theme !== this.theme && this.of.length > 0) this.legend(theme);
    this.theme = theme;
  }
  paint(canvas, image, theme) {
    canvas.width = image ? image.wide : 1; canvas.height = image ? image.high : 1;
    const g = canvas.getContext('2d');
    g.fillStyle = theme.panel; g.fillRect(0, 0, canvas.width, canvas.height);
    if (!image) return;
    for (let i = 0; i < image.pixels.length; ++i) {
      const letter = image.pixels.charCodeAt(i);
      if (letter === 32) continue;
      g.fillStyle = letter === 33 ? theme.pink : depth_colour(letter - 64, theme);
      g.fillRect(i % image.wide, Math.floor(i / image.wide), 1, 1);
    }
  }
  legend(theme) {
    const range_m = this.of.find(Boolean).images[0].range_m, box = (colour, words) => `<span><i class="box" style="background:${colour}"></i>${words}</span>`;
    $('depths').innerHTML = [0, 0.5, 1].map(r => box(depth_colour(r * (kLevels - 1), theme),
      `${words_of_number(kNearest_m * Math.pow(range_m / kNearest_m, r))} m`)).join('') + box(theme.panel, 'nothing in range') + box(theme.pink, 'no value');
  }
}

/** Near is bright. */
function depth_colour(level, theme) { return speed_colour(1 - level / (kLevels - 1), theme); }
