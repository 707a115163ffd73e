// Starts the page's program, which stx packs so that the page is hardly larger than its images.

// Bytes of what stx wrote as text (page_text.hpp): two characters are 31 bits, the first two the number of bytes.
function bytesOf(id) {
    const text = document.getElementById(id).textContent;
    const pair = (i) => text.charCodeAt(i) - 8448 + 46341 * (text.charCodeAt(i + 1) - 8448);
    const bytes = new Uint8Array(pair(0));
    let at = 0, bits = 0, count = 0;
    const put = (value, more) => {
        bits |= value << count;
        for (count += more; count >= 8; count -= 8, bits >>>= 8) bytes[at++] = bits;
    };
    for (let i = 2; at < bytes.length; i += 2) {
        const value = pair(i);  // integers of JavaScript hold 32 bits, of which up to 7 are there
        put(value & 65535, 16);
        put(value >>> 16, 15);
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
