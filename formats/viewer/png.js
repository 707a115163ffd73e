// PNG as integers. A browser's own decoder gives 8 bits, and mixes colours with their alpha. JPEG at the end.

// Undoes the filter of a row (PNG, 9.2); `before` is the row above, `each` the bytes of a pixel.
function unfilter(kind, row, before, each) {
    for (let i = 0; i < row.length; ++i) {
        const a = i >= each ? row[i - each] : 0, b = before[i], c = i >= each ? before[i - each] : 0;
        let guess = 0;
        if (kind === 1) guess = a;
        else if (kind === 2) guess = b;
        else if (kind === 3) guess = (a + b) >> 1;
        else if (kind === 4) {
            const p = a + b - c, pa = Math.abs(p - a), pb = Math.abs(p - b), pc = Math.abs(p - c);
            guess = pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
        }
        row[i] += guess;
    }
}

// {width, height, channels, values}: rows from the top, channels interleaved, Uint8Array or Uint16Array.
async function decodePng(bytes) {
    const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    const width = view.getUint32(16), height = view.getUint32(20), bits = bytes[24];
    const channels = [1, 0, 3, 0, 2, 0, 4][bytes[25]];
    const parts = [];
    for (let at = 8; at + 12 <= bytes.length;) {
        const length = view.getUint32(at), name = view.getUint32(at + 4);
        if (name === 0x49444154) parts.push(bytes.subarray(at + 8, at + 8 + length));  // IDAT
        at += length + 12;
    }
    const packed = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
    parts.reduce((at, part) => (packed.set(part, at), at + part.length), 0);
    const data = new Uint8Array(await inflated(packed).arrayBuffer());
    const each = channels * bits / 8, stride = width * each;
    const plain = new Uint8Array(height * stride);
    let before = new Uint8Array(stride);
    for (let y = 0; y < height; ++y) {
        const row = plain.subarray(y * stride, (y + 1) * stride);
        row.set(data.subarray(y * (stride + 1) + 1, (y + 1) * (stride + 1)));
        if (data[y * (stride + 1)]) unfilter(data[y * (stride + 1)], row, before, each);
        before = row;
    }
    if (bits === 8) return {width, height, channels, values: plain};
    const values = new Uint16Array(plain.length / 2);
    for (let i = 0; i < values.length; ++i) values[i] = plain[2 * i] << 8 | plain[2 * i + 1];
    return {width, height, channels, values};
}

// JPEG, which has no alpha to mix colours with, by the browser's own decoder.
async function decodeJpeg(bytes) {
    const picture = await createImageBitmap(new Blob([bytes], {type: "image/jpeg"}), {colorSpaceConversion: "none"});
    const {width, height} = picture, canvas = Object.assign(document.createElement("canvas"), {width, height});
    const context = canvas.getContext("2d", {willReadFrequently: true});
    context.drawImage(picture, 0, 0);
    picture.close();
    return {width, height, channels: 4, values: new Uint8Array(context.getImageData(0, 0, width, height).data.buffer)};
}

const decodeImage = (bytes) => bytes[0] === 0xff ? decodeJpeg(bytes) : decodePng(bytes);
