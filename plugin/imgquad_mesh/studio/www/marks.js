// Marks that are painted on the picture: strokes in pixels of the picture, drawn at once, and as a PNG without blur.

export const BRUSHES = ["#e6194b", "#3cb44b", "#4363d8", "#ffe119", "#f58231", "#911eb4", "#42d4f4", "#f032e6", "#9a6324", "#808000"];

// Draws the strokes over the view.
export function drawStrokes(canvas, strokes, view) {
  Object.assign(canvas, { width: view.canvas.width, height: view.canvas.height });
  const context = canvas.getContext("2d"), ratio = view.ratio;
  context.lineCap = context.lineJoin = "round";
  for (const { brush, radius, points } of strokes?.list ?? []) {
    context.strokeStyle = strokes.brushes[brush];
    context.lineWidth = Math.max(2, 2 * radius * view.camera.scale);
    context.beginPath();
    for (let k = 0; k < points.length; k += 2) {
      const [x, y] = view.toScreen(points[k], points[k + 1]);
      if (!k) context.moveTo(x * ratio, y * ratio - 0.01); // a dot is a line, too
      context.lineTo(x * ratio, y * ratio);
    }
    context.stroke();
  }
}

// The strokes as a PNG of the picture's size: exact colours, clear where nothing is marked.
export async function strokesAsPng(strokes, [width, height]) {
  const image = new ImageData(width, height), pixels = new Uint32Array(image.data.buffer);
  for (const { brush, radius, points } of strokes.list) {
    const color = parseInt(strokes.brushes[brush].slice(1), 16);
    const packed = (0xff000000 | ((color & 255) << 16) | (color & 0xff00) | (color >> 16)) >>> 0;
    along(points, Math.max(0.5, radius / 2), (x, y) => disc(pixels, width, height, x, y, radius, packed));
  }
  const canvas = new OffscreenCanvas(width, height);
  canvas.getContext("2d").putImageData(image, 0, 0);
  return canvas.convertToBlob({ type: "image/png" });
}

function along(points, step, visit) {
  visit(points[0], points[1]);
  for (let k = 2; k < points.length; k += 2) {
    const [x0, y0, x1, y1] = points.slice(k - 2, k + 2), n = Math.ceil(Math.hypot(x1 - x0, y1 - y0) / step);
    for (let i = 1; i <= n; i++) visit(x0 + ((x1 - x0) * i) / n, y0 + ((y1 - y0) * i) / n);
  }
}

function disc(pixels, width, height, x, y, radius, color) {
  const r = Math.max(radius, 0.71);
  for (let row = Math.max(0, Math.floor(y - r)); row <= Math.min(height - 1, y + r); row++) {
    for (let column = Math.max(0, Math.floor(x - r)); column <= Math.min(width - 1, x + r); column++) {
      if ((column + 0.5 - x) ** 2 + (row + 0.5 - y) ** 2 <= r * r) pixels[row * width + column] = color;
    }
  }
}
