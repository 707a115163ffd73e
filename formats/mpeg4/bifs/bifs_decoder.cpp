#include "formats/mpeg4/bifs/bifs.hpp"

#include <algorithm>
#include <iterator>

#include "formats/mpeg4/bifs/bifs_nodes.hpp"
#include "formats/mpeg4/bifs/interface_types.hpp"

namespace stx::mpeg4 {

/// The commands of access units (ISO/IEC 14496-11 clause 8).
struct BifsDecoder::Impl : BifsNodeReader {
    using BifsNodeReader::BifsNodeReader;

    std::uint64_t bitsLeft = 0;
    std::vector<Command> begun;

    Result<Position> readPosition(int explicitBits) {
        Position position;
        switch (in.read(2)) {
            case 0:
                position.index = static_cast<int>(in.read(explicitBits));
                break;
            case 2:
                position.index = 0;
                break;
            case 3:
                position.index = Position::kLast;
                break;
            default:
                return error(ErrorCode::invalidInput, "a position of kind 1, which is reserved");
        }
        STX_CHECK(check("a position"));
        return position;
    }

    Result<ReplaceScene> readScene() {
        ReplaceScene scene;
        in.read(6);
        useNames = in.flag();
        scene.useNames = useNames;
        defined.clear();
        around = nullptr;
        protoScopes.assign(1, {});
        protoCount = 0;
        quantisation.setGlobal(nullptr);
        STX_CHECK(readProtos(1));
        scene.protos = protoScopes.front();
        int height = 0;
        STX_TRY(scene.root, readNode(Ndt::SFTopNode, 1, height));
        STX_CHECK(check("the scene"));
        STX_TRY(scene.routes, readRoutes());
        return scene;
    }

    Result<void> keep(Result<Command> c) {
        if (!c) return tl::unexpected(c.error());
        STX_CHECK(useBudget(sizeof(Command)));
        begun.push_back(std::move(*c));
        return {};
    }

    Result<Command> readInsert(std::uint32_t kind) {
        switch (kind) {
            case 0: {
                InsertNode c;
                STX_TRY(c.target, readTarget());
                const int children = c.target->info->find("children");
                if (children < 0)
                    return error(ErrorCode::invalidInput,
                                 "a node is inserted into {}, which has no children",
                                 c.target->info->name);
                STX_TRY(c.position, readPosition(8));
                int height = 0;
                STX_TRY(c.node, readNode(c.target->info->fields[children].nodeType, 1, height));
                if (!c.node) return error(ErrorCode::invalidInput, "NULL is inserted as a child");
                return c;
            }
            case 2: {
                InsertIndexed c;
                STX_CHECK(readIndexed(c));
                return c;
            }
            default: {
                STX_TRY(Route route, readRoute());
                return InsertRoute{std::move(route)};
            }
        }
    }

    /// Extended commands, as far as they say what plain ones can say, which they become. What they
    /// do to PROTOs and quantisation is in what is read after them. An unknown one adds nothing.
    Result<void> readExtended() {
        const std::size_t before = begun.size();
        auto done = readExtended(in.read(8));
        if (done) return {};
        begun.erase(begun.begin() + static_cast<std::ptrdiff_t>(before), begun.end());
        // Others may write them in other ways, and no scene needs them to be shown.
        done.error().code = ErrorCode::unsupported;
        return done;
    }
    Result<void> readExtended(std::uint32_t kind) {
        STX_CHECK(check("a command"));
        // In a buffer there is nobody to keep what is declared for later commands.
        const bool declares = kind <= 2 || kind == 5;
        if (kind > 6 || (declares && around != nullptr))
            return error(ErrorCode::unsupported,
                         "an extended BIFS command of kind {}, which is not supported", kind);
        switch (kind) {
            case 0:
                return readProtos(1);
            case 1:
                return readDeletedProtos();
            case 2:
                return {};  // deletes all PROTOs
            case 3:
                return readManyItems();
            case 4:
                return readManyFields();
            case 5: {
                int height = 0;
                STX_TRY(NodePtr node, readNode(Ndt::SFWorldNode, 1, height));
                quantisation.setGlobal(std::move(node));
                return {};
            }
            default: {
                STX_TRY(NodePtr target, readTarget());
                return keep(DeleteNode{std::move(target)});
            }
        }
    }

    /// Declarations that later commands do not use do no harm: deleted ones stay.
    Result<void> readDeletedProtos() {
        if (in.flag()) {
            while (in.flag()) in.read(config.protoIdBits);
            return check("a list of PROTOs");
        }
        const std::uint64_t count = in.read(static_cast<int>(in.read(5)));
        if (count > kMaxProtos)
            return error(ErrorCode::invalidInput, "{} PROTOs are deleted; {} may be declared",
                         count, kMaxProtos);
        for (std::uint64_t i = 0; i < count; ++i) in.read(config.protoIdBits);
        return check("a list of PROTOs");
    }

    /// Replaces items of a list (MULTIPLEINDREPLACE).
    Result<void> readManyItems() {
        ReplaceIndexed c;
        STX_TRY(c.target, readTarget());
        STX_CHECK(readListField(c));
        const int bits = static_cast<int>(in.read(5));
        const std::uint64_t count = in.read(static_cast<int>(in.read(5)));
        for (std::uint64_t i = 0; i < count; ++i) {
            const std::uint32_t index = in.read(bits);
            STX_CHECK(check("a position"));
            if (index > 0xFFFF)
                return error(ErrorCode::unsupported,
                             "a position of {} in a list, which plain commands cannot have", index);
            c.position.index = static_cast<int>(index);
            STX_CHECK(readItemOf(c));
            STX_CHECK(keep(c));
        }
        return {};
    }

    /// Replaces fields of a node, which are coded as those of a new node (MULTIPLEREPLACE). Where a
    /// node has only fields that plain commands do not reach, as a DepthImage, it is replaced.
    Result<void> readManyFields() {
        STX_TRY(const NodePtr target, readTarget());
        const NodeInfo& info = *target->info;
        const NodePtr changed = std::make_shared<Node>(*target);
        std::vector<ReplaceField> each;
        bool reached = true;
        const auto readOne = [&](int index) -> Result<void> {
            const FieldInfo& field = info.fields[index];
            reached = reached && field.inId >= 0 && field.type != FieldType::MFScript;
            if (!reached && !info.inFields.empty())
                return error(ErrorCode::unsupported,
                             "a command that replaces {}.{}, which plain commands cannot do",
                             info.name, field.name);
            STX_CHECK(useBudget(sizeof(Command)));
            STX_TRY(FieldValue value, readField(info, field, 1));
            quantisation.coded(field, value);
            if (reached) each.push_back({target, index, value});
            changed->set(index, std::move(value));
            return {};
        };
        STX_CHECK(readEachField(info, readOne));
        if (reached) {
            std::ranges::move(each, std::back_inserter(begun));
            return {};
        }
        Defined& known = defined[target->defId];
        known = {changed, std::max(known.height, deepest + 1), command};
        return keep(ReplaceNode{target, changed});
    }

    template <class C>
    Result<void> readListField(C& c) {
        STX_TRY(c.field, readInField(*c.target));
        const FieldInfo& field = c.target->info->fields[c.field];
        if (!isMultiple(field.type))
            return error(ErrorCode::invalidInput, "an index into {}.{}, which is {}",
                         c.target->info->name, field.name, name(field.type));
        return {};
    }

    template <class C>
    Result<void> readItemOf(C& c) {
        const FieldInfo& field = c.target->info->fields[c.field];
        STX_TRY(c.value, readSingle(*c.target->info, field, 1));
        if (const NodePtr* node = std::get_if<NodePtr>(&c.value); node && !*node)
            return error(ErrorCode::invalidInput, "NULL is put into {}.{}", c.target->info->name,
                         field.name);
        return {};
    }

    template <class C>
    Result<void> readIndexed(C& c) {
        STX_TRY(c.target, readTarget());
        STX_CHECK(readListField(c));
        STX_TRY(c.position, readPosition(16));
        if constexpr (requires { c.value; }) return readItemOf(c);
        return {};
    }

    Result<Command> readDelete() {
        switch (in.read(2)) {
            case 0: {
                STX_TRY(NodePtr target, readTarget());
                return DeleteNode{std::move(target)};
            }
            case 2: {
                DeleteIndexed c;
                STX_CHECK(readIndexed(c));
                return c;
            }
            case 3: {
                DeleteRoute c{in.read(config.routeIdBits) + 1};
                STX_CHECK(check("a command"));
                return c;
            }
            default:
                return error(ErrorCode::invalidInput,
                             "a delete command of kind 1, which is reserved");
        }
    }

    Result<Command> readReplace() {
        switch (in.read(2)) {
            case 0: {
                ReplaceNode c;
                STX_TRY(c.target, readTarget());
                int height = 0;
                STX_TRY(c.replacement, readNode(Ndt::SFWorldNode, 1, height));
                return c;
            }
            case 1: {
                ReplaceField c;
                STX_TRY(c.target, readTarget());
                STX_TRY(c.field, readInField(*c.target));
                STX_TRY(c.value, readField(*c.target->info, c.target->info->fields[c.field], 1));
                return c;
            }
            case 2: {
                ReplaceIndexed c;
                STX_CHECK(readIndexed(c));
                return c;
            }
            default: {
                ReplaceRoute c;
                c.routeId = in.read(config.routeIdBits) + 1;
                STX_CHECK(readEnds(c.route));
                c.route.id = c.routeId;
                return c;
            }
        }
    }

    /// Adds to `begun`.
    Result<void> readCommand() {
        ++command;
        deepest = 0;
        switch (in.read(2)) {
            case 0: {
                const std::uint32_t kind = in.read(2);
                return kind == 1 ? readExtended() : keep(readInsert(kind));
            }
            case 1:
                return keep(readDelete());
            case 2:
                return keep(readReplace());
            default:
                return keep(readScene());
        }
    }

    Result<std::vector<Command>> decode(ByteSpan accessUnit) {
        in = BitReader(accessUnit);
        begun.clear();
        // What an access unit before left open when it was not understood.
        proto = nullptr;
        protoScopes.resize(1);
        do {
            STX_CHECK(readCommand());
            const bool more = in.flag();
            STX_CHECK(check("a command"));
            if (!more) break;
        } while (true);
        bitsLeft = in.left();
        return std::exchange(begun, {});
    }
};

BifsDecoder::BifsDecoder(BifsConfig config, const Limits& limits)
    : impl_(std::make_unique<Impl>(config, limits)) {}
BifsDecoder::~BifsDecoder() = default;
BifsDecoder::BifsDecoder(BifsDecoder&&) noexcept = default;

Result<std::vector<Command>> BifsDecoder::decode(ByteSpan accessUnit) {
    return impl_->decode(accessUnit);
}
Result<std::vector<Command>> BifsDecoder::decodeBuffer(const CommandBuffer& buffer,
                                                       const BufferScene& scene,
                                                       const Limits& limits) {
    const CommandCoding coding = buffer.coding.value_or(CommandCoding());
    BifsConfig config;
    config.version = 2;
    config.nodeIdBits = coding.nodeIdBits;
    config.routeIdBits = coding.routeIdBits;
    config.protoIdBits = coding.protoIdBits;
    config.usePredictiveMFField = coding.usePredictiveMFField;
    Impl impl(config, limits);
    impl.useNames = coding.useNames;
    impl.around = &scene;
    impl.protoScopes.front() = scene.protos;
    return impl.decode(std::as_bytes(std::span(buffer.bytes)));
}
std::vector<Command> BifsDecoder::begun() {
    return std::exchange(impl_->begun, {});
}
void BifsDecoder::setConfig(const BifsConfig& config) {
    impl_->config = config;
}
CommandCoding BifsDecoder::coding() const {
    return codingOf(impl_->config, impl_->useNames);
}
const std::vector<ProtoPtr>& BifsDecoder::protos() const {
    return impl_->protoScopes.front();
}
std::size_t BifsDecoder::renamed() const {
    return impl_->renamed;
}
CommandCoding codingOf(const BifsConfig& config, bool useNames) {
    return {config.nodeIdBits, config.routeIdBits, config.version == 2 ? config.protoIdBits : 0,
            useNames, config.usePredictiveMFField};
}
std::uint64_t BifsDecoder::bitsLeft() const {
    return impl_->bitsLeft;
}

}  // namespace stx::mpeg4
