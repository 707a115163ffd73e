#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "lib/base/job.hpp"
#include "lib/model/bundle.hpp"
#include "lib/model/peak_memory.hpp"
#include "lib/model/view_summary.hpp"

namespace stx {

/// Which images a view has besides its depth, and what its colour is.
struct ViewImageKinds {
    bool linear = false;  ///< colour is linear floats, not 8-bit sRGB
    bool normal = false, splatU = false, splatV = false;
    bool metallicRoughness = false, emissive = false;

    [[nodiscard]] static ViewImageKinds of(const ReferenceView& view);
    [[nodiscard]] bool hasSplats() const { return splatU && splatV; }
    [[nodiscard]] bool hasMaterial() const { return metallicRoughness || emissive; }
    /// Memory of all images of a view, bytes for each of its pixels.
    [[nodiscard]] std::uint64_t bytesPerPixel() const;
    bool operator==(const ViewImageKinds&) const = default;
};

/// A bundle whose pixels are read, or made, when a view is asked for: what goes through the views
/// one by one (forEachView()) takes the memory of one for each thread, however many there are.
///
/// What a view says beside its pixels is known from the start, and a view that comes is held
/// against it: a file whose headers and pixels disagree, or that changed since it was opened, is an
/// error (invalidInput) of the view at which it shows.
class ViewTable {
  public:
    virtual ~ViewTable() = default;
    ViewTable(const ViewTable&) = delete;
    ViewTable& operator=(const ViewTable&) = delete;

    /// The bundle with the headers of its views. Images are there only if whole().
    [[nodiscard]] const Bundle& about() const { return *about_; }
    /// The same, of tables that have a bundle of their own (all but viewsOf()): for title, time and
    /// environment.
    [[nodiscard]] Bundle& about() { return own_; }
    [[nodiscard]] std::size_t count() const { return kinds_.size(); }
    [[nodiscard]] const ViewImageKinds& kindsOf(std::size_t index) const { return kinds_[index]; }
    [[nodiscard]] const std::vector<ViewImageKinds>& kinds() const { return kinds_; }
    /// All pixels are in memory, in about().
    [[nodiscard]] bool whole() const { return whole_; }
    /// Each view has been read once and was sound: it is damaged only if its file changed since.
    [[nodiscard]] virtual bool knownSound() const { return whole_; }
    /// The planes in about() are those of the views. If not, they come with the pixels.
    [[nodiscard]] bool planesKnown() const { return planesKnown_; }

    /// One view (below count()) with its pixels; it passes ReferenceView::check(). Asked for again,
    /// it may be read again. Safe from several threads. Errors: reading; (invalidInput) the pixels
    /// are not what about() says.
    [[nodiscard]] Result<std::shared_ptr<const ReferenceView>> view(std::size_t index,
                                                                    Job& job) const;

    /// Memory of the images of a view, bytes.
    [[nodiscard]] std::uint64_t bytesOf(std::size_t index) const;
    /// Memory that the table itself takes for pixels.
    [[nodiscard]] virtual std::uint64_t bytesHeld() const { return 0; }
    /// Beside that: of a view that view() gave, and what view() takes at its peak, that included.
    [[nodiscard]] virtual std::uint64_t bytesGiven(std::size_t index) const {
        return bytesOf(index);
    }
    [[nodiscard]] virtual std::uint64_t bytesToMake(std::size_t index) const {
        return bytesGiven(index);
    }
    [[nodiscard]] std::uint64_t pixelsOf(std::size_t index) const;
    /// What the file keeps of its views for those who draw without their pixels, one for each;
    /// empty where it does not of all of them. Pixels that come need not agree.
    [[nodiscard]] virtual std::vector<ViewSummary> summaries() const { return {}; }
    /// The file that it is read from, in quotes, for messages; may be empty.
    [[nodiscard]] virtual std::string where() const { return {}; }
    /// Views that may be made at a time; 0: any number.
    [[nodiscard]] virtual int mostAtOnce() const { return 0; }

  protected:
    enum class Planes { known, withPixels };
    /// Of headers (images are empty) and as many kinds.
    ViewTable(Bundle headers, std::vector<ViewImageKinds> kinds, Planes planes = Planes::known);
    /// Of a bundle in memory, its own.
    explicit ViewTable(Bundle whole);
    /// Of somebody else's, who keeps it.
    explicit ViewTable(const Bundle* whole);

    [[nodiscard]] virtual Result<std::shared_ptr<const ReferenceView>> make(std::size_t index,
                                                                            Job& job) const = 0;

  private:
    Bundle own_;
    const Bundle* about_ = &own_;
    std::vector<ViewImageKinds> kinds_;
    bool whole_ = false, planesKnown_ = true;
};

/// The same bundle without images: of its views what a ViewHeader has.
[[nodiscard]] Bundle headersOf(const Bundle& bundle);
/// A bundle in memory as a table. The second kind does not copy it; it must outlive the table.
[[nodiscard]] std::unique_ptr<ViewTable> tableOf(Bundle bundle);
[[nodiscard]] std::unique_ptr<ViewTable> viewsOf(const Bundle& bundle);
/// A bundle whose images are in a spool, as a table that keeps both. It is not whole(): what takes
/// views one by one finds them there. `held`: what the spool takes of memory at most, bytes.
[[nodiscard]] std::unique_ptr<ViewTable> tableOf(Bundle bundle, std::unique_ptr<PixelSpool> spool,
                                                 std::uint64_t held);
/// All views of a table in memory. Errors: those of its views; (invalidInput) more than the memory
/// limit.
[[nodiscard]] Result<Bundle> wholeBundle(const ViewTable& table, Job& job);
/// The same in a spool, which must outlive it; memory is taken as by forEachView().
[[nodiscard]] Result<Bundle> wholeBundle(const ViewTable& table, PixelSpool& spool, Job& job);
/// Some of the views, in a spool if it is not null; the others have their headers only. `look`, if
/// any, is called with each that is read, from any thread.
[[nodiscard]] Result<Bundle> someViews(
    const ViewTable& table, const std::vector<bool>& wanted, PixelSpool* spool, Job& job,
    const std::function<Result<void>(std::size_t index, const ReferenceView& view)>& look = {});
/// The same; what is in memory already is moved.
[[nodiscard]] Result<Bundle> wholeBundle(std::unique_ptr<ViewTable> table, Job& job);

/// As Bundle::noteMaterialLeftOut().
void noteMaterialLeftOut(const ViewTable& table, Job& job);
/// Whether all views have normals, as a file needs it whose points all have the same values. A note
/// says that normals are left out where only some views have them.
[[nodiscard]] bool allHaveNormals(const ViewTable& table, Job& job);

/// A change of single views: it looks at nothing but the one that it is given.
struct ViewChange {
    /// Name and size of the camera stay, as do the images that `kinds` does not add. From several
    /// threads.
    std::function<Result<void>(ReferenceView& view, Job& job)> change;
    /// Adds the images that a changed view has more.
    std::function<void(ViewImageKinds& kinds)> kinds;
    /// Changes what is known of a view before its pixels are: all but name, size and planes.
    std::function<void(ViewHeader& header)> header;
    /// What it takes beside the view, with what it adds.
    PeakMemory takes;
    /// Colours and depth stay, too: what is kept of the views (ViewTable::summaries()) stays true.
    bool keepsPixels = false;
};
/// The same views, each changed when it is asked for.
[[nodiscard]] std::unique_ptr<ViewTable> changedViews(std::unique_ptr<ViewTable> table,
                                                      ViewChange change);
/// The same views with what these headers, one for each, say beside name, camera and colour file.
[[nodiscard]] std::unique_ptr<ViewTable> withHeaders(std::unique_ptr<ViewTable> table,
                                                     const std::vector<ViewHeader>& headers);
/// The same views; `look` is called, from any thread, with each that is asked for, each time.
[[nodiscard]] std::unique_ptr<ViewTable> watchedViews(
    std::unique_ptr<ViewTable> table,
    std::function<void(std::size_t index, const ReferenceView& view)> look);

/// Views that would be read twice, and whose images take no more than so many bytes, are all in
/// memory when they are opened as a table: that is faster, and hardly shows beside the program.
[[nodiscard]] std::uint64_t heldWhole(const Limits& limits);
/// Memory that forEachView() takes at most for such work on each view, and what work on all of them
/// at once takes (checkPeak()), their images included, bytes.
[[nodiscard]] std::uint64_t memoryOfEach(const ViewTable& table, const PeakMemory& work);
[[nodiscard]] std::uint64_t memoryOfAll(const ViewTable& table, const PeakMemory& work);

/// The part of the memory limit that holds what is in use of a spool, where views are in one.
/// Smaller parts save little: the rest is what work on a view takes.
inline constexpr std::uint64_t kSpoolPart = 32;
/// Memory of such work on as many views at a time as the limit has room for, beside such a spool
/// with all of them, bytes. Above the limit: even one view is too large.
[[nodiscard]] std::uint64_t memoryFromSpool(const ViewTable& table, const PeakMemory& work,
                                            const Limits& limits);

/// Goes through all views, in rounds of as many at a time as there are threads and as the memory
/// limit has room for (one where PeakMemory::oneByOneFrom says so): `each` is called with a view
/// from several threads, then `inOrder`, if any, for the views of the round one after the other, in
/// their order. Views are given back after their `each`, unless it keeps them. `work` is what
/// `each` and `inOrder` take beside one view. Errors: (invalidInput) before the first view is read,
/// one view takes more than the limit; those of view(), of `each` and of `inOrder`, the first by
/// number; cancelled. `enough`, if any, is asked before each round: true leaves out what is left.
[[nodiscard]] Result<void> forEachView(
    const ViewTable& table, const PeakMemory& work, Job& job,
    const std::function<Result<void>(std::size_t index, std::shared_ptr<const ReferenceView> view)>&
        each,
    const std::function<Result<void>(std::size_t index)>& inOrder = {},
    const std::function<bool()>& enough = {});

}  // namespace stx
