#include "formats/mpeg4/bifs/bifs.hpp"
#include "formats/mpeg4/bifs/bifs_nodes.hpp"

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
        STX_CHECK(readProtos(1));
        scene.protos = protoScopes.front();
        int height = 0;
        STX_TRY(scene.root, readNode(Ndt::SFTopNode, 1, height));
        STX_CHECK(check("the scene"));
        STX_TRY(scene.routes, readRoutes());
        return scene;
    }

    Result<Command> readInsert() {
        switch (in.read(2)) {
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
                STX_TRY(
                    c.node,
                    readNode(c.target->info->fields[static_cast<std::size_t>(children)].nodeType, 1,
                             height));
                if (!c.node) return error(ErrorCode::invalidInput, "NULL is inserted as a child");
                return c;
            }
            case 2: {
                InsertIndexed c;
                STX_CHECK(readIndexed(c, true));
                return c;
            }
            case 3: {
                STX_TRY(Route route, readRoute());
                return InsertRoute{std::move(route)};
            }
            default:
                return error(ErrorCode::unsupported,
                             "an extended BIFS command, which is not supported");
        }
    }

    template <class C>
    Result<void> readIndexed(C& c, bool withValue) {
        STX_TRY(c.target, readTarget());
        STX_TRY(c.field, readInField(*c.target));
        const FieldInfo& field = c.target->info->fields[static_cast<std::size_t>(c.field)];
        if (!isMultiple(field.type))
            return error(ErrorCode::invalidInput, "an index into {}.{}, which is {}",
                         c.target->info->name, field.name, name(field.type));
        STX_TRY(c.position, readPosition(16));
        if constexpr (requires { c.value; }) {
            if (withValue) {
                STX_TRY(c.value, readSingle(*c.target->info, field, 1));
                if (const NodePtr* node = std::get_if<NodePtr>(&c.value); node && !*node)
                    return error(ErrorCode::invalidInput, "NULL is put into {}.{}",
                                 c.target->info->name, field.name);
            }
        }
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
                STX_CHECK(readIndexed(c, false));
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
                STX_TRY(c.value,
                        readField(*c.target->info,
                                  c.target->info->fields[static_cast<std::size_t>(c.field)], 1));
                return c;
            }
            case 2: {
                ReplaceIndexed c;
                STX_CHECK(readIndexed(c, true));
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

    Result<Command> readCommand() {
        ++command;
        deepest = 0;
        STX_CHECK(useBudget(sizeof(Command)));
        switch (in.read(2)) {
            case 0:
                return readInsert();
            case 1:
                return readDelete();
            case 2:
                return readReplace();
            default: {
                STX_TRY(ReplaceScene scene, readScene());
                return scene;
            }
        }
    }

    Result<std::vector<Command>> decode(ByteSpan accessUnit) {
        in = BitReader(accessUnit);
        begun.clear();
        do {
            STX_TRY(Command next, readCommand());
            begun.push_back(std::move(next));
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
