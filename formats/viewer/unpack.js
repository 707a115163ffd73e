// Starts the page's program, which stx packs so that the page is hardly larger than its images.
(async () => {
    const message = document.getElementById("message");
    try {
        if (typeof DecompressionStream === "undefined") throw new Error("old");
        const packed = Uint8Array.from(atob(document.getElementById("code").textContent), (c) => c.charCodeAt(0));
        const script = document.createElement("script");
        script.textContent = await new Response(
            new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
        document.head.append(script);
    } catch (error) {
        message.className = "failed";
        message.textContent = "This browser is too old to unpack the page (DecompressionStream). Versions since 2023 can.";
    }
})();
