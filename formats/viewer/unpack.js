// Starts the page's program, which stx packs so that the page is hardly larger than its images.

// Bytes of what stx wrote as text (page_text.hpp): two characters of 91 are 13 bits, a last one is 6.
function bytesOf(id) {
    const text = document.getElementById(id).textContent, pairs = text.length >> 1, digit = [];
    for (let c = 33, n = 0; c < 127; ++c) if (c !== 34 && c !== 38 && c !== 60) digit[c] = n++;
    const bytes = new Uint8Array(Math.floor((13 * pairs + 6 * (text.length & 1)) / 8));
    for (let i = 0, at = 0, bits = 0, count = 0; at < bytes.length; i += 2) {
        bits |= (digit[text.charCodeAt(i)] + (i + 1 < text.length ? 91 * digit[text.charCodeAt(i + 1)] : 0)) << count;
        for (count += 13; count >= 8 && at < bytes.length; count -= 8, bits >>= 8) bytes[at++] = bits;
    }
    return bytes;
}

// What a stream of zlib holds, as an answer of fetch.
function inflated(bytes) {
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate")));
}

(async () => {
    try {
        if (typeof DecompressionStream === "undefined") throw new Error("old");
        const script = document.createElement("script");
        script.textContent = await inflated(bytesOf("code")).text();
        document.head.append(script);
    } catch (error) {
        const message = document.getElementById("message");
        message.className = "failed";
        message.textContent = "This browser is too old to unpack the page (DecompressionStream). Versions since 2023 can.";
    }
})();
