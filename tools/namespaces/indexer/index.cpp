// SPDX-License-Identifier: Apache-2.0
// Writes where a source names what stands in namespace wheelwright, and what it declares there; one fact on a line.
#include <clang/AST/ASTConsumer.h>
#include <clang/AST/RecursiveASTVisitor.h>
#include <clang/Frontend/CompilerInstance.h>
#include <clang/Frontend/FrontendAction.h>
#include <clang/Lex/Lexer.h>
#include <clang/Tooling/ArgumentsAdjusters.h>
#include <clang/Tooling/CompilationDatabase.h>
#include <clang/Tooling/Tooling.h>
#include <llvm/Support/FileSystem.h>
#include <llvm/Support/raw_ostream.h>
#include <fstream>
#include <iostream>
#include <map>
#include <set>
#include <string>

using namespace clang;

static std::string root;  // with a slash at the end
static std::set<std::string> facts;

static std::map<std::string, std::string> real_paths;
static std::string real(const std::string& name) {
  auto& r = real_paths[name];
  if (r.empty()) {
    llvm::SmallString<256> out;
    r = llvm::sys::fs::real_path(name, out) ? name : out.str().str();
  }
  return r;
}

class Visitor : public RecursiveASTVisitor<Visitor> {
 public:
  explicit Visitor(ASTContext& c) : context(c), sm(c.getSourceManager()) {}
  using Base = RecursiveASTVisitor<Visitor>;

  ASTContext& context;
  SourceManager& sm;

  // file and offset of a location as it is written; empty outside the tree
  bool place(SourceLocation loc, std::string& file, unsigned& offset, bool& macro) {
    macro = false;
    if (loc.isInvalid()) return false;
    while (loc.isMacroID()) {
      if (!sm.isMacroArgExpansion(loc)) macro = true;
      loc = sm.getImmediateSpellingLoc(loc);
    }
    auto [id, off] = sm.getDecomposedLoc(loc);
    const FileEntry* entry = sm.getFileEntryForID(id);
    if (!entry) return false;
    file = real(entry->getName().str());
    if (file.compare(0, root.size(), root) != 0) return false;
    file = file.substr(root.size());
    offset = off;
    return true;
  }

  static bool ours(const Decl* d) {
    const DeclContext* c = d->getDeclContext();
    const NamespaceDecl* outer = isa<NamespaceDecl>(d) ? cast<NamespaceDecl>(d) : nullptr;
    for (; c && !c->isTranslationUnit(); c = c->getParent())
      if (auto* n = dyn_cast<NamespaceDecl>(c)) outer = n;
    return outer && outer->getName() == "wheelwright";
  }

  static std::string spaces(const DeclContext* c) {
    std::string out;
    for (; c && !c->isTranslationUnit(); c = c->getParent())
      if (auto* n = dyn_cast<NamespaceDecl>(c)) {
        std::string name = n->isAnonymousNamespace() ? "(anon)" : n->getName().str();
        out = out.empty() ? name : name + "::" + out;
      }
    return out;
  }

  static const Decl* canonical_place(const NamedDecl* d) {
    if (auto* t = dyn_cast<TagDecl>(d)) {
      if (auto* s = dyn_cast<ClassTemplateSpecializationDecl>(t)) return canonical_place(s->getSpecializedTemplate());
      if (auto* def = t->getDefinition()) return def;
    }
    if (auto* t = dyn_cast<ClassTemplateDecl>(d)) {
      if (auto* def = t->getTemplatedDecl()->getDefinition()) return def;
    }
    return d->getCanonicalDecl();
  }

  std::vector<const DeclContext*> stack;
  const DeclContext* current() { return stack.empty() ? nullptr : stack.back(); }
  std::string here_;
  std::vector<std::string> space_stack;

  bool TraverseNamespaceDecl(NamespaceDecl* d) {
    space_stack.push_back((space_stack.empty() ? "" : space_stack.back() + "::") +
                          (d->isAnonymousNamespace() ? "(anon)" : d->getName().str()));
    bool r = Base::TraverseNamespaceDecl(d);
    space_stack.pop_back();
    return r;
  }
  // system headers are not walked
  bool TraverseDecl(Decl* d) {
    if (!d) return true;
    if (!isa<TranslationUnitDecl>(d) && !isa<NamespaceDecl>(d) && d->getDeclContext() &&
        d->getDeclContext()->isFileContext()) {
      SourceLocation loc = sm.getExpansionLoc(d->getBeginLoc());
      if (loc.isInvalid()) return true;
      if (sm.isInSystemHeader(loc)) return true;
    }
    return Base::TraverseDecl(d);
  }

  void use(SourceLocation loc, const NamedDecl* d, const char* kind, bool shadow = false) {
    if (!d) return;
    const DeclContext* c = d->getDeclContext()->getRedeclContext();
    const bool enumerator = isa<EnumConstantDecl>(d);
    if (enumerator) return;
    if (!c->isNamespace()) return;  // members and locals are found through others
    if (!ours(d)) return;
    std::string file;
    unsigned offset;
    bool macro;
    if (!place(loc, file, offset, macro)) return;
    const Decl* home = canonical_place(d);
    std::string hfile;
    unsigned hoff;
    bool hm;
    if (!place(home->getLocation(), hfile, hoff, hm)) hfile = "?";
    std::string name = d->getDeclName().isIdentifier() ? d->getName().str() : d->getNameAsString();
    if (auto* n = dyn_cast<NamespaceDecl>(d)) {
      if (n->isAnonymousNamespace()) return;
    }
    std::string s = std::string("U\t") + file + "\t" + std::to_string(offset) + "\t" + name + "\t" + kind + "\t" +
                    spaces(d->getDeclContext()) + "\t" + hfile + "\t" +
                    (space_stack.empty() ? "" : space_stack.back()) + "\t" + (macro ? "macro" : "") + "\t" +
                    (shadow ? "shadow" : "");
    facts.insert(s);
  }

  bool VisitTagTypeLoc(TagTypeLoc t) {
    use(t.getNameLoc(), t.getDecl(), "type");
    return true;
  }
  bool VisitTypedefTypeLoc(TypedefTypeLoc t) {
    use(t.getNameLoc(), t.getTypedefNameDecl(), "type");
    return true;
  }
  bool VisitInjectedClassNameTypeLoc(InjectedClassNameTypeLoc) { return true; }
  bool VisitTemplateSpecializationTypeLoc(TemplateSpecializationTypeLoc t) {
    use(t.getTemplateNameLoc(), t.getTypePtr()->getTemplateName().getAsTemplateDecl(), "type");
    return true;
  }
  bool VisitDeducedTemplateSpecializationTypeLoc(DeducedTemplateSpecializationTypeLoc t) {
    use(t.getTemplateNameLoc(), t.getTypePtr()->getTemplateName().getAsTemplateDecl(), "type");
    return true;
  }
  bool VisitUsingTypeLoc(UsingTypeLoc t) {
    use(t.getNameLoc(), t.getFoundDecl()->getTargetDecl(), "type", true);
    return true;
  }
  bool TraverseTemplateArgumentLoc(const TemplateArgumentLoc& a) {
    if (a.getArgument().getKind() == TemplateArgument::Template)
      use(a.getTemplateNameLoc(), a.getArgument().getAsTemplate().getAsTemplateDecl(), "type");
    return Base::TraverseTemplateArgumentLoc(a);
  }
  bool VisitDeclRefExpr(DeclRefExpr* e) {
    NamedDecl* found = e->getFoundDecl();
    const bool shadow = isa<UsingShadowDecl>(found);
    const NamedDecl* d = e->getDecl();
    if (auto* f = dyn_cast<FunctionDecl>(d)) {
      if (auto* p = f->getPrimaryTemplate()) d = p;
    } else if (auto* v = dyn_cast<VarDecl>(d)) {
      if (auto* s = dyn_cast<VarTemplateSpecializationDecl>(v)) d = s->getSpecializedTemplate();
    }
    use(e->getNameInfo().getLoc(), d, isa<FunctionDecl>(e->getDecl()) ? "function" : "variable", shadow);
    return true;
  }
  bool VisitOverloadExpr(OverloadExpr* e) {
    if (isa<UnresolvedMemberExpr>(e)) return true;
    for (NamedDecl* d : e->decls()) {
      const bool shadow = isa<UsingShadowDecl>(d);
      use(e->getNameLoc(), d->getUnderlyingDecl(), "overload", shadow);
    }
    return true;
  }
  bool VisitUnresolvedLookupExpr(UnresolvedLookupExpr* e) { return VisitOverloadExpr(e); }
  bool VisitConceptSpecializationExpr(ConceptSpecializationExpr* e) {
    use(e->getConceptNameLoc(), e->getNamedConcept(), "concept");
    return true;
  }
  bool VisitTemplateTypeParmDecl(TemplateTypeParmDecl* d) {
    if (auto* c = d->getTypeConstraint()) use(c->getConceptNameLoc(), c->getNamedConcept(), "concept");
    return true;
  }
  bool VisitAutoTypeLoc(AutoTypeLoc t) {
    if (t.isConstrained()) use(t.getConceptNameLoc(), t.getNamedConcept(), "concept");
    return true;
  }
  bool TraverseNestedNameSpecifierLoc(NestedNameSpecifierLoc n) {
    if (n) {
      if (auto* s = n.getNestedNameSpecifier()->getAsNamespace()) use(n.getLocalBeginLoc(), s, "namespace");
      if (auto* s = n.getNestedNameSpecifier()->getAsNamespaceAlias()) use(n.getLocalBeginLoc(), s, "alias");
    }
    return Base::TraverseNestedNameSpecifierLoc(n);
  }
  bool VisitUsingDirectiveDecl(UsingDirectiveDecl* d) {
    use(d->getIdentLocation(), d->getNominatedNamespaceAsWritten(), "directive");
    return true;
  }
  bool VisitNamespaceAliasDecl(NamespaceAliasDecl* d) {
    use(d->getTargetNameLoc(), d->getAliasedNamespace(), "aliased");
    return true;
  }
  bool VisitUsingDecl(UsingDecl* d) {
    for (auto* s : d->shadows()) use(d->getLocation(), s->getTargetDecl(), "using");
    return true;
  }
  bool VisitUsingShadowDecl(UsingShadowDecl*) { return true; }

  // what is declared in a namespace of ours
  bool VisitNamedDecl(NamedDecl* d) {
    if (isa<UsingShadowDecl>(d) || isa<UsingDecl>(d) || isa<UsingDirectiveDecl>(d)) return true;
    const bool space = isa<NamespaceDecl>(d);
    const bool in_friend = d->getFriendObjectKind() != Decl::FOK_None;
    if (!d->getLexicalDeclContext()->getRedeclContext()->isFileContext() && !in_friend) return true;
    if (!space && !d->getDeclContext()->getRedeclContext()->isFileContext()) {
      return true;  // out-of-line members
    }
    std::string file;
    unsigned offset;
    bool macro;
    if (!place(d->getLocation(), file, offset, macro)) return true;
    std::string kind = d->getDeclKindName();
    bool definition = false;
    if (auto* t = dyn_cast<TagDecl>(d)) definition = t->isThisDeclarationADefinition();
    if (auto* t = dyn_cast<ClassTemplateDecl>(d)) definition = t->isThisDeclarationADefinition();
    if (auto* f = dyn_cast<FunctionDecl>(d)) definition = f->isThisDeclarationADefinition();
    std::string extra;
    if (auto* f = dyn_cast<FunctionDecl>(d)) {
      for (auto* p : f->parameters()) extra += p->getType().getCanonicalType().getAsString() + "; ";
      if (f->isOverloadedOperator()) extra = "OPERATOR " + extra;
    }
    if (auto* s = dyn_cast<ClassTemplateSpecializationDecl>(d)) {
      std::string hf;
      unsigned ho;
      bool hm;
      extra = place(s->getSpecializedTemplate()->getLocation(), hf, ho, hm) ? "SPECIAL " + hf : "SPECIAL-OUTSIDE";
    }
    for (char& ch : extra)
      if (ch == '\n' || ch == '\t') ch = ' ';
    std::string begin_file;
    unsigned begin = 0;
    bool m2;
    place(d->getBeginLoc(), begin_file, begin, m2);
    facts.insert("D\t" + file + "\t" + std::to_string(offset) + "\t" + d->getNameAsString() + "\t" + kind + "\t" +
                 spaces(d->getDeclContext()) + "\t" + (definition ? "definition" : "") + "\t" +
                 (in_friend ? "friend" : "") + "\t" + std::to_string(begin) + "\t" + extra);
    return true;
  }
};

class Consumer : public ASTConsumer {
 public:
  void HandleTranslationUnit(ASTContext& c) override { Visitor(c).TraverseDecl(c.getTranslationUnitDecl()); }
};
class Action : public ASTFrontendAction {
  std::unique_ptr<ASTConsumer> CreateASTConsumer(CompilerInstance& ci, StringRef) override {
    ci.getDiagnosticOpts().ErrorLimit = 20;
    return std::make_unique<Consumer>();
  }
};

int main(int argc, char** argv) {
  // index ROOT DATABASE_DIRECTORY OUTPUT file...
  root = std::string(argv[1]) + "/";
  std::string error;
  auto db = tooling::CompilationDatabase::loadFromDirectory(argv[2], error);
  if (!db) {
    std::cerr << error;
    return 2;
  }
  std::vector<std::string> files(argv + 4, argv + argc);
  tooling::ClangTool tool(*db, files);
  tool.appendArgumentsAdjuster(tooling::getInsertArgumentAdjuster(
      {"-resource-dir", "/usr/lib/llvm-16/lib/clang/16", "-w", "-Wno-everything", "-Wno-error"},
      tooling::ArgumentInsertPosition::END));
  int r = tool.run(tooling::newFrontendActionFactory<Action>().get());
  std::ofstream out(argv[3]);
  for (auto& f : facts) out << f << "\n";
  return r;
}
